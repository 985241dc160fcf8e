// SPDX-License-Identifier: BSD-3-Clause
#include "report_json.h"

#include <pcl/surface/mrf/option_table.h>
#include <pcl/surface/mrf/report.h>

#include <nlohmann/json.hpp>

#include <string>
#include <variant>

namespace mrf_apps {
namespace {

using Json = nlohmann::ordered_json;
using namespace pcl::mrf;

/// By stages, as the options' table names them.
Json toJson(const Options& options)
{
  Json json;
  for (const OptionDeclaration& option : optionDeclarations()) {
    const Json value = std::visit([](const auto& held) { return Json(held); }, option.exact(options));
    if (const std::size_t dot = option.key.find('.'); dot == std::string::npos)
      json[option.key] = value;
    else
      json[option.key.substr(0, dot)][option.key.substr(dot + 1)] = value;
  }
  json["confidenceField"] = options.confidenceField; // the only text
  return json;
}

Json toJson(const PointCounts& points)
{
  return {{"input", points.input},
          {"notFinite", points.notFinite},
          {"duplicates", points.duplicates},
          {"zeroNormals", points.zeroNormals},
          {"zeroConfidence", points.zeroConfidence},
          {"outliersAlone", points.outliersAlone},
          {"outliersBySpacing", points.outliersBySpacing},
          {"outliersByStatistics", points.outliersByStatistics},
          {"noiseByPlaneFit", points.noiseByPlaneFit},
          {"smallComponents", points.smallComponents},
          {"outliersByField", points.outliersByField},
          {"alone", points.alone},
          {"used", points.used}};
}

Json toJson(const OrientationSummary& orientation)
{
  return {{"components", orientation.components},
          {"componentsAtCreases", orientation.componentsAtCreases},
          {"componentsDropped", orientation.componentsDropped},
          {"componentsFlipped", orientation.componentsFlipped},
          {"pointsDropped", orientation.pointsDropped},
          {"pointsFlipped", orientation.pointsFlipped},
          {"agreement", orientation.agreement},
          {"openShare", orientation.openShare},
          {"sideIsGuessed", orientation.sideIsGuessed}};
}

Json toJson(const SmoothingChoice& choice)
{
  Json curve = Json::array();
  for (const SmoothingScore& score : choice.curve)
    curve.push_back({{"smoothing", score.smoothing}, {"error", score.error}});
  return {{"smoothing", choice.smoothing}, {"noise", choice.noise}, {"heldOut", choice.heldOut}, {"curve", curve}};
}

Json toJson(const ResolutionChoice& choice)
{
  Json curve = Json::array();
  for (const ResolutionScore& score : choice.curve)
    curve.push_back({{"voxelSize", score.voxelSize}, {"error", score.error}});
  return {{"voxelSize", choice.voxelSize}, {"heldOut", choice.heldOut}, {"cubes", choice.cubes}, {"curve", curve}};
}

Json toJson(const LevelReport& level)
{
  return {{"size", {level.size.x, level.size.y, level.size.z}},
          {"voxelSize", level.voxelSize},
          {"maxDistance", level.maxDistance},
          {"observed", level.observed},
          {"unknowns", level.unknowns},
          {"observationSeconds", level.observationSeconds},
          {"solverSeconds", level.solverSeconds},
          {"solve",
           {{"method", nameOf(level.solve.method)},
            {"iterations", level.solve.iterations},
            {"relativeResidual", level.solve.relativeResidual},
            {"remainingChange", level.solve.remainingChange},
            {"remainingChangeOfFillings", level.solve.remainingChangeOfFillings},
            {"converged", level.solve.converged},
            {"history", level.solve.history}}}};
}

Json toJson(const SigmaQuantiles& sigma)
{
  return {
      {"vertices", sigma.vertices}, {"median", sigma.median}, {"percentile95", sigma.percentile95}, {"max", sigma.max}};
}

Json toJson(const SampledQuantity& quantity)
{
  return {
      {"mean", quantity.mean}, {"deviation", quantity.deviation}, {"lower", quantity.lower}, {"upper", quantity.upper}};
}

Json toJson(const SampledShape& shape)
{
  return {{"surfaces", shape.surfaces},
          {"volume", shape.isClosed ? toJson(shape.volume) : Json()},
          {"area", toJson(shape.area)},
          {"extent", {toJson(shape.extent[0]), toJson(shape.extent[1]), toJson(shape.extent[2])}}};
}

Json toJson(const UncertaintyReport& uncertainty)
{
  return {{"samples", uncertainty.samples},
          {"voxelSize", uncertainty.voxelSize},
          {"voxels", uncertainty.voxels},
          {"noise", uncertainty.noise},
          {"heldOut", uncertainty.heldOut},
          {"measuredError", uncertainty.measuredError},
          {"offset", uncertainty.offset},
          {"patches", uncertainty.patches},
          {"patchPoints", uncertainty.patchPoints},
          {"largestPatch", uncertainty.largestPatch},
          {"largestOpening", uncertainty.largestOpening},
          {"fillingFactor", uncertainty.fillingFactor},
          {"notCalibrated", uncertainty.notCalibrated},
          {"measured", toJson(uncertainty.measured)},
          {"fillings", toJson(uncertainty.fillings)},
          {"shape", toJson(uncertainty.shape)}};
}

} // namespace

Json toJson(const MeshStatistics& mesh)
{
  return {{"vertices", mesh.vertices},
          {"triangles", mesh.triangles},
          {"edges", mesh.edges},
          {"components", mesh.components},
          {"boundaryEdges", mesh.boundaryEdges},
          {"boundaryLoops", mesh.boundaryLoops},
          {"nonManifoldEdges", mesh.nonManifoldEdges},
          {"nonManifoldVertices", mesh.nonManifoldVertices},
          {"degenerateTriangles", mesh.degenerateTriangles},
          {"unusedVertices", mesh.unusedVertices},
          {"eulerCharacteristic", mesh.eulerCharacteristic},
          {"area", mesh.area},
          {"volume", mesh.volume},
          {"meanQuality", mesh.meanQuality},
          {"minQuality", mesh.minQuality},
          {"meanEdge", mesh.meanEdge},
          {"minEdge", mesh.minEdge},
          {"maxEdge", mesh.maxEdge},
          {"areaDeviation", mesh.areaDeviation},
          {"valences", mesh.valences}};
}

Json toJson(const std::vector<LevelReport>& levels)
{
  Json result = Json::array();
  for (const LevelReport& level : levels)
    result.push_back(toJson(level));
  return result;
}

Json toJson(const Report& report)
{
  Json otherPieces = Json::array();
  for (const PieceReport& piece : report.otherPieces)
    otherPieces.push_back({{"points", piece.points}, {"levels", toJson(piece.levels)}});
  Json times = Json::array();
  for (const StageTime& time : report.times)
    times.push_back({{"stage", time.stage}, {"seconds", time.seconds}});
  Json json = {{"status", toString(report.status)},
               {"message", report.message},
               {"warnings", report.warnings},
               {"options", toJson(report.options)},
               {"density",
                {{"spacing", report.density.spacing},
                 {"nearestMean", report.density.nearestMean},
                 {"nearestDeviation", report.density.nearestDeviation},
                 {"eighthMedian", report.density.eighthMedian}}},
               {"diagonal", report.diagonal},
               {"smoothingLength", report.smoothingLength},
               {"smoothing", toJson(report.smoothing)},
               {"resolution", toJson(report.resolution)},
               {"points", toJson(report.points)},
               {"normalsEstimated", report.normalsEstimated},
               {"vote", nameOf(report.vote)},
               {"sensorOriginUsed", report.sensorOriginUsed},
               {"sensorSupposed", report.sensorSupposed},
               {"orientation", toJson(report.orientation)},
               {"levels", toJson(report.levels)},
               {"otherPieces", otherPieces},
               {"trimming",
                {{"holesFilled", report.trimming.holesFilled},
                 {"extrapolationsDropped", report.trimming.extrapolationsDropped},
                 {"componentsDropped", report.trimming.componentsDropped},
                 {"areaFilled", report.trimming.areaFilled},
                 {"areaDropped", report.trimming.areaDropped},
                 {"largestHole", report.trimming.largestHole}}},
               {"remesher",
                {{"splits", report.remesher.splits},
                 {"collapses", report.remesher.collapses},
                 {"flips", report.remesher.flips},
                 {"refusedOperations", report.remesher.refusedOperations}}},
               {"intersectingTriangles",
                {{"beforeRemeshing", report.intersectingBeforeRemeshing}, {"mesh", report.intersecting}}},
               {"meshBeforeRemeshing", toJson(report.meshBeforeRemeshing)},
               {"mesh", toJson(report.mesh)},
               {"times", times},
               {"seconds", report.seconds},
               {"predictedBytes", report.predictedBytes},
               {"peakBytes", report.peakBytes},
               {"threads", report.threads}};
  if (report.uncertainty.isComputed)
    json["uncertainty"] = toJson(report.uncertainty);
  if (report.options.uncertainty.maxError > 0)
    json["beyondError"] = {{"triangles", report.beyondError.triangles},
                           {"area", report.beyondError.area},
                           {"measuredArea", report.beyondError.measuredArea}};
  return json;
}

} // namespace mrf_apps

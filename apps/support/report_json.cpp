// SPDX-License-Identifier: BSD-3-Clause
#include "report_json.h"

#include "text_file.h"

#include <pcl/surface/mrf/option_table.h>

#include <nlohmann/json.hpp>

#include <type_traits>
#include <variant>

using Json = nlohmann::ordered_json;

// The functions by which nlohmann-json converts the library's types.
namespace pcl::mrf {

static void to_json(Json& json, Status status)
{
  json = toString(status);
}

template <typename Enum, typename = std::enable_if_t<std::is_enum_v<Enum>>>
static void to_json(Json& json, Enum value)
{
  json = nameOf(value);
}

static void to_json(Json& json, const GridSize& size)
{
  json = {size.x, size.y, size.z};
}

/// Nested by stage, under the names of the options' table.
static void to_json(Json& json, const Options& options)
{
  for (const OptionDeclaration& option : optionDeclarations()) {
    const Json value = std::visit([](const auto& held) { return Json(held); }, option.exact(options));
    if (const std::size_t dot = option.name.find('.'); dot == std::string::npos)
      json[option.name] = value;
    else
      json[option.name.substr(0, dot)][option.name.substr(dot + 1)] = value;
  }
  // Options that are texts, which are not in the table.
  json["confidenceField"] = options.confidenceField;
  json["noiseField"] = options.noiseField;
  json["observation"]["noiseModel"] = options.observation.noiseModel;
}

MRF_JSON(PointCounts, input, notFinite, duplicates, zeroNormals, zeroConfidence, outliersAlone, outliersByStatistics,
         mixedPixels, ghosts, noiseByPlaneFit, smallComponents, outliersByField, alone, used)
MRF_JSON(SamplingDensity, spacing, nearestMean, nearestDeviation, eighthMedian)
MRF_JSON(OrientationSummary, components, componentsAtCreases, componentsDropped, componentsFlipped, piecesFlipped,
         pointsDropped, pointsFlipped, agreement, openShare, sideIsGuessed)
MRF_JSON(SmoothingScore, smoothing, error)
MRF_JSON(SmoothingChoice, smoothing, noise, heldOut, curve)

static void to_json(Json& json, const NoiseReport& noise)
{
  Json groups = Json::array();
  for (const NoiseByKey& group : noise.groups)
    groups.push_back({{noise.isByRange ? "range" : "ofSpacing", group.key},
                      {"spacing", group.spacing},
                      {"deviation", group.deviation},
                      {"white", group.white},
                      {"correlation", group.correlation}});
  json = {{"isKnown", noise.isKnown},     {"isByRange", noise.isByRange},     {"isCorrelated", noise.isCorrelated},
          {"medianKey", noise.medianKey}, {"deviation", noise.deviation},     {"smoothing", noise.smoothing},
          {"exponent", noise.exponent},   {"lengthening", noise.lengthening}, {"groups", groups}};
}

MRF_JSON(ResolutionScore, voxelSize, error)
MRF_JSON(ResolutionChoice, voxelSize, heldOut, cubes, curve)
MRF_JSON(SolveReport, method, iterations, relativeResidual, remainingChange, remainingChangeOfFillings, converged,
         history)
MRF_JSON(LevelReport, size, voxelSize, maxDistance, observed, unknowns, tiles, observationSeconds, solverSeconds, solve)
MRF_JSON(PieceReport, points, levels)
MRF_JSON(TrimSummary, holesFilled, extrapolationsDropped, componentsDropped, areaFilled, areaDropped, largestHole,
         cappedShare)
MRF_JSON(RemeshSummary, splits, collapses, flips, refusedOperations)
MRF_JSON(MeshStatistics, vertices, triangles, edges, components, boundaryEdges, boundaryLoops, nonManifoldEdges,
         nonManifoldVertices, degenerateTriangles, unusedVertices, eulerCharacteristic, area, volume, meanQuality,
         minQuality, meanEdge, minEdge, maxEdge, areaDeviation, valences)
MRF_JSON(SigmaQuantiles, vertices, median, percentile95, max)
MRF_JSON(SampledQuantity, mean, deviation, lower, upper)

static void to_json(Json& json, const SampledShape& shape)
{
  json = {{"surfaces", shape.surfaces},
          {"volume", shape.isClosed ? Json(shape.volume) : Json()},
          {"area", shape.area},
          {"extent", shape.extent}};
}

MRF_JSON(UncertaintyReport, samples, voxelSize, voxels, noise, heldOut, measuredError, offset, patches, patchPoints,
         largestPatch, largestOpening, fillingFactor, notCalibrated, measured, fillings, shape)
MRF_JSON(ErrorLimitSummary, triangles, area, measuredArea)
MRF_JSON(StageTime, stage, seconds)
MRF_JSON(Report, status, message, warnings, options, density, diagonal, noise, smoothingLength, smoothing, resolution,
         points, normalsEstimated, normalsFilled, signsOpposed, vote, sensorOriginUsed, sensorSupposed, orientation,
         levels, otherPieces, trimming, remesher, meshBeforeRemeshing, mesh, times, seconds, predictedBytes, peakBytes,
         threads)

} // namespace pcl::mrf

namespace mrf_apps {

Json toJson(const pcl::mrf::MeshStatistics& mesh)
{
  return mesh;
}

Json toJson(const pcl::mrf::Report& report)
{
  Json json = report;
  json["intersectingTriangles"] = {{"beforeRemeshing", report.intersectingBeforeRemeshing},
                                   {"mesh", report.intersecting}};
  if (report.uncertainty.isComputed)
    json["uncertainty"] = report.uncertainty;
  if (report.options.uncertainty.maxError > 0)
    json["beyondError"] = report.beyondError;
  return json;
}

void writeJson(const std::string& path, const Json& json)
{
  writeText(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "comparisons.h"
#include "evaluate/evaluation.h"
#include "evaluate/surface_distance.h"
#include "evaluate/surface_samples.h"
#include "figure_support.h"
#include "methods.h"
#include "program.h"
#include "real_clouds.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/reconstruction.h>

#include <optional>

namespace mrf_apps {

using figures::Lazy;
using figures::rounded;
using nlohmann::json;
using pcl::mrf::Execution;
using Places = std::vector<Eigen::Vector3d>;

namespace {

constexpr int depth = 9; ///< of Poisson's octree

struct RealResult {
  SurfaceMesh mesh;
  std::optional<double> droppedShare; ///< of the input's points; none: the method does not say
  double processorSeconds = 0;
};

struct RealMethod {
  std::string id, title;
  bool needsSensor;
  std::function<RealResult(const RealCloud&, Execution&)> run;
};

double droppedShare(const pcl::mrf::PointCounts& counts)
{
  const auto known = static_cast<double>(counts.input - counts.notFinite - counts.duplicates);
  return known > 0 ? 1 - static_cast<double>(counts.used) / known : 0;
}

/// \param hasNormals false: they are estimated and turned to the sensor
RealResult runOurs(const RealCloud& cloud, bool hasNormals, Execution& execution)
{
  pcl::mrf::Options options;
  options.remesher.rounds = 0;
  const pcl::mrf::Reconstruction result = reconstruct(cloud, hasNormals, options, execution);
  return {figures::toSurfaceMesh(result), droppedShare(result.report.points), 0};
}

std::vector<RealMethod> realMethods()
{
  const auto ofMethod = [](const Method& method) {
    return RealMethod{method.id, method.title, false, [method](const RealCloud& cloud, Execution& execution) {
                        return RealResult{method.run(cloud.input, 0, execution), std::nullopt, 0};
                      }};
  };
  std::vector<RealMethod> result = {
      {"default", "this (default)", false,
       [](const RealCloud& cloud, Execution& execution) { return runOurs(cloud, true, execution); }},
      {"estimated", "this, normals estimated, one sensor known", true,
       [](const RealCloud& cloud, Execution& execution) { return runOurs(cloud, false, execution); }},
      ofMethod(poissonMethod(depth))};
  const std::string path = findProgram("PoissonRecon");
  if (!path.empty())
    result.push_back(
        ofMethod(programMethod("PoissonRecon", "PoissonRecon, depth " + std::to_string(depth), path, depth)));
  return result;
}

RealResult timed(const RealMethod& method, const RealCloud& cloud, Execution& execution)
{
  const Stopwatch watch;
  RealResult result = method.run(cloud, execution);
  result.processorSeconds = watch.processorSeconds();
  if (!hasArea(result.mesh))
    throw pcl::mrf::InvalidInput("there is no surface");
  return result;
}

json measureReal(const RealResult& result, const RealCloud& cloud, Execution& execution)
{
  EvaluationInput input;
  input.cloud = cloud.input.positions;
  input.cloudNormals = figures::toFloat(cloud.input.normals);
  input.heldOut = cloud.discs;
  EvaluationOptions options;
  options.samples = 100000;
  const auto local = compareLocally(result.mesh, input, options, execution);
  if (!local)
    throw pcl::mrf::InvalidInput("the cloud has too few points");
  const Statistics random = summarize(SurfaceDistance(result.mesh).distances(cloud.random, execution));
  const auto orNull = [](const std::optional<double>& value) { return value ? json(*value) : json(); };
  return {{"points", cloud.input.size()},
          {"unevenness", local->unevenness},
          {"discs", orNull(local->heldOutRms)},
          {"random", random.rms / local->spacing},
          {"input", local->cloudRms},
          {"near", local->nearShare},
          {"invented", local->inventedShare},
          {"flipped", orNull(local->flippedShare)},
          {"dropped", orNull(result.droppedShare)},
          {"triangles", result.mesh.triangles.size()},
          {"processorSeconds", result.processorSeconds}};
}

std::vector<json> rowOf(const RealCase& oneCase, const RealMethod& method, const json& measured, std::size_t columns)
{
  std::vector<json> row = {oneCase.title, method.title};
  if (measured.contains("failed")) {
    row.push_back(measured["failed"]);
    row.resize(columns);
    return row;
  }
  const auto add = [&](const char* name, double factor, int digits) {
    const json& value = measured[name];
    row.push_back(value.is_number() ? json(rounded(factor * value.get<double>(), digits)) : json());
  };
  for (const char* name : {"discs", "random", "input"})
    add(name, 1, 3);
  // Shares near 100 % keep the digits that tell them apart.
  add("near", 100, 5);
  for (const char* name : {"invented", "flipped", "dropped"})
    add(name, 100, 3);
  row.push_back(measured["points"]);
  add("unevenness", 1, 2);
  row.push_back(measured["triangles"]);
  add("processorSeconds", 1, 3);
  return row;
}

} // namespace

Section real(Laboratory& laboratory)
{
  Section section{"real", "Real clouds", {}, {}, {}, {}};
  section.paragraphs = {
      "Clouds as scanners deliver them: open, of uneven density, with clutter. Those of --data/real were measured; the "
      "others are simulated: rays on a regular angular grid from one sensor (terrain: three), so that density falls "
      "with distance and angle, with a noise of a fifth of the mean spacing. Two kinds of points are withheld from all "
      "methods: discs with radii of 5 to 10 local spacings, and a random tenth.",
      "The local spacing of a point is .313 times the distance to its 8th neighbor; RMS distances are given in the "
      "median of the cloud. Near is the share of the input within 5 of its own local spacings of the mesh: a point "
      "that was dropped is not. Invented is the share of the mesh's area that is farther than 10 local spacings from "
      "the input, flipped the share of the given normals against the nearest triangle, dropped that of the input that "
      "the method did not use.",
      "All methods are given the same normals, apart from the row that estimates them. Nothing is remeshed. CPU "
      "seconds "
      "are those of all threads. Poisson's surface is not trimmed: what it invents is to be cut off by the user."};
  Table table{"real",
              "Per cloud: RMS in median local spacings, shares in %",
              {"cloud", "method", "discs RMS", "random RMS", "input RMS", "near %", "invented %", "flipped %",
               "dropped %", "points", "unevenness", "triangles", "CPU s"},
              {}};
  for (const RealCase& oneCase : realClouds(laboratory.options(), laboratory.execution()))
    for (const RealMethod& method : realMethods()) {
      if (method.needsSensor && !oneCase.hasOneSensor)
        continue;
      Lazy<RealResult> result([&] { return timed(method, oneCase.load(), laboratory.execution()); });
      const json measured = laboratory.measure("real/" + oneCase.id + "/" + method.id, [&] {
        return measureReal(result(), oneCase.load(), laboratory.execution());
      });
      table.rows.push_back(rowOf(oneCase, method, measured, table.columns.size()));
      if (measured.contains("failed") || !laboratory.options().hasPictures)
        continue;
      const std::string file = "real-" + oneCase.id + "-" + method.id + ".png";
      PictureOptions picture = oneCase.view(oneCase.load());
      picture.width = picture.height = 700;
      laboratory.draw(file, picture, [&] { return result().mesh; });
      section.pictures.push_back({file, oneCase.title + ": " + method.title});
    }
  if (laboratory.options().quick)
    section.paragraphs.push_back("Quick: of the simulated clouds only the table, with fewer points.");
  section.tables = {table};
  return section;
}

} // namespace mrf_apps

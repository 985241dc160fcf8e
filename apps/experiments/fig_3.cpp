// SPDX-License-Identifier: BSD-3-Clause
#include "evaluate/surface_distance.h"
#include "evaluate/surface_samples.h"
#include "field/prior.h"
#include "figure_support.h"
#include "figures.h"
#include "scan/analytic_surface.h"

#include <pcl/surface/mrf/options.h>

#include <algorithm>
#include <cmath>

namespace mrf_apps {

using namespace figures;
using nlohmann::json;
using pcl::mrf::Execution;
using pcl::mrf::Prior;
using pcl::mrf::scan::AnalyticSurface;

namespace {

constexpr double tubeRadius = .25, tubeLength = 1, gap = .5;

pcl::mrf::scan::Scan scanShape(const AnalyticSurface& surface, std::int64_t points, Laboratory& laboratory)
{
  pcl::mrf::scan::ScanOptions options;
  options.views.count = 0;
  options.sampling.points = points;
  options.seed = laboratory.options().seed;
  return simulateScan(surface, options, laboratory.execution());
}

pcl::mrf::Reconstruction reconstructWith(Prior prior, const pcl::mrf::scan::Scan& scan, Execution& execution)
{
  pcl::mrf::Options options;
  options.prior.kind = prior;
  return reconstruct(scan.cloud.positions, scan.cloud.normals, options, execution);
}

json toJson(const Statistics& statistics, double voxel)
{
  return {{"rms", statistics.rms / voxel},
          {"percentile95", statistics.percentile95 / voxel},
          {"max", statistics.max / voxel}};
}

/// Even places on the part of the tube that is missing between the two.
Places placesInGap()
{
  Places places;
  constexpr int along = 200, around = 300;
  for (int i = 0; i < along; ++i)
    for (int j = 0; j < around; ++j) {
      const double angle = 2 * M_PI * j / around;
      places.emplace_back(gap * ((i + .5) / along - .5), tubeRadius * std::cos(angle), tubeRadius * std::sin(angle));
    }
  return places;
}

/// Whether one component connects both tubes, how far the bridge is from a straight tube, and how wide its middle is.
json measureTubes(const pcl::mrf::Reconstruction& result, std::uint64_t seed, Execution& execution)
{
  const double voxel = result.report.options.multiscale.voxelSize;
  const SurfaceMesh mesh = toSurfaceMesh(result);
  const SurfaceDistance distance(mesh);
  json measured;
  measured["components"] = result.report.mesh.components;
  measured["gap"] = toJson(summarize(distance.distances(placesInGap(), execution)), voxel);

  std::vector<double> errors;
  double sum = 0;
  std::int64_t count = 0;
  for (const Eigen::Vector3d& place : sampleSurface(mesh, 200000, seed).positions) {
    const double axial = std::abs(place.x()), radius = std::hypot(place.y(), place.z());
    // Beside the ends the fillings of the open tubes begin.
    if (axial > gap / 2 + voxel && axial < gap / 2 + tubeLength - voxel)
      errors.push_back(std::abs(radius - tubeRadius));
    if (axial < voxel) {
      sum += radius;
      ++count;
    }
  }
  measured["elsewhere"] = toJson(summarize(std::move(errors)), voxel);
  measured["waist"] = count > 0 ? json(sum / static_cast<double>(count)) : json();
  return measured;
}

void addTubes(Laboratory& laboratory, Section& section)
{
  const AnalyticSurface surface(pcl::mrf::scan::makeShape("tubes:radius=" + text(tubeRadius) +
                                                          ",length=" + text(tubeLength) + ",gap=" + text(gap)));
  const std::int64_t points = laboratory.options().quick ? 3000 : 8000;
  Lazy<pcl::mrf::scan::Scan> scan([&] { return scanShape(surface, points, laboratory); });
  Table table{"fig-3-tubes",
              "Two tubes of radius " + text(tubeRadius) + " with a gap of " + text(gap) +
                  ": distance to one straight tube, voxels",
              {"prior", "components", "gap, RMS", "gap, 95 %", "gap, largest", "radius in the middle of the gap",
               "where data are, RMS", "where data are, largest"},
              {}};
  for (const Prior prior : allPriors) {
    Lazy<pcl::mrf::Reconstruction> result([&] { return reconstructWith(prior, scan(), laboratory.execution()); });
    const std::string k = std::to_string(order(prior));
    const json measured = laboratory.measure("fig-3/tubes/k=" + k, [&] {
      return measureTubes(result(), laboratory.options().seed, laboratory.execution());
    });
    if (measured.contains("failed")) {
      table.rows.push_back({nameOf(prior), measured["failed"]});
      continue;
    }
    const json& waist = measured["waist"];
    table.rows.push_back({nameOf(prior), measured["components"], rounded(measured["gap"]["rms"]),
                          rounded(measured["gap"]["percentile95"]), rounded(measured["gap"]["max"]),
                          waist.is_null() ? waist : json(rounded(waist)), rounded(measured["elsewhere"]["rms"]),
                          rounded(measured["elsewhere"]["max"])});
    PictureOptions picture;
    picture.width = 900;
    picture.height = 420;
    picture.from = {.12, .3, 1};
    picture.extent = 1.45;
    const std::string file = "fig-3-tubes-" + k + ".png";
    laboratory.draw(file, picture, [&] {
      SurfaceMesh mesh = toSurfaceMesh(result());
      colorByConfidence(mesh);
      return mesh;
    });
    section.pictures.push_back({file, std::string("tubes, ") + nameOf(prior) + "; blue: no data"});
  }
  section.tables.push_back(table);
}

json measurePrimitives(const pcl::mrf::Reconstruction& result, const shapes::Sdf& truth, std::uint64_t seed)
{
  std::vector<double> errors;
  for (const Eigen::Vector3d& place : sampleSurface(toSurfaceMesh(result), 200000, seed).positions)
    errors.push_back(std::abs(truth(place)));
  return {{"components", result.report.mesh.components},
          {"surface", toJson(summarize(std::move(errors)), result.report.options.multiscale.voxelSize)}};
}

void addPrimitives(Laboratory& laboratory, Section& section)
{
  const AnalyticSurface surface(pcl::mrf::scan::makeShape("primitives"));
  const std::int64_t points = laboratory.options().quick ? 8000 : 30000;
  Lazy<pcl::mrf::scan::Scan> scan([&] { return scanShape(surface, points, laboratory); });
  Table table{"fig-3-primitives",
              "Collection of eight primitives: distance to the true surface, voxels",
              {"prior", "components", "RMS", "95 %", "largest (sharp edges)"},
              {}};
  for (const Prior prior : allPriors) {
    Lazy<pcl::mrf::Reconstruction> result([&] { return reconstructWith(prior, scan(), laboratory.execution()); });
    const std::string k = std::to_string(order(prior));
    const json measured = laboratory.measure("fig-3/primitives/k=" + k, [&] {
      return measurePrimitives(result(), surface.distance(), laboratory.options().seed);
    });
    if (measured.contains("failed")) {
      table.rows.push_back({nameOf(prior), measured["failed"]});
      continue;
    }
    const json& errors = measured["surface"];
    table.rows.push_back({nameOf(prior), measured["components"], rounded(errors["rms"]),
                          rounded(errors["percentile95"]), rounded(errors["max"])});
    PictureOptions picture;
    picture.width = 900;
    picture.height = 560;
    picture.from = {.2, .35, 1};
    picture.extent = 2.9;
    const std::string file = "fig-3-primitives-" + k + ".png";
    laboratory.draw(file, picture, [&] { return toSurfaceMesh(result()); });
    section.pictures.push_back({file, std::string("primitives, ") + nameOf(prior)});
  }
  section.tables.push_back(table);
}

} // namespace

Section fig3(Laboratory& laboratory)
{
  Section section{"fig-3", "Fig. 3: the three priors", {}, {}, {}, {}};
  section.paragraphs = {
      "Two open tubes along one axis, and a collection of spheres, boxes, a torus, a cylinder and a plate, each "
      "covered evenly with points and exact normals and reconstructed with default options and each of the three "
      "priors.",
      "In the gap the truth is taken to be the straight tube that goes through both: distances are from evenly spread "
      "places of it to the surface, so that a gap that is not bridged counts as well. Elsewhere, and for the "
      "primitives, they are from evenly spread samples of the surface to the exact shape.",
      "The paper's figure shows that the membrane (differences of neighbors) closes what is open with the least area, "
      "while the thin plate (Laplacian) continues the tangents. The triharmonic prior, which continues curvature, is "
      "the exact minimizer of the energy that the paper writes for its Laplacian prior."};
  addTubes(laboratory, section);
  addPrimitives(laboratory, section);
  return section;
}

} // namespace mrf_apps

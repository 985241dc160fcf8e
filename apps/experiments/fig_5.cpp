// SPDX-License-Identifier: BSD-3-Clause
#include "evaluate/surface_distance.h"
#include "field/prior.h"
#include "figure_support.h"
#include "figures.h"
#include "poisson.h"
#include "scan/analytic_surface.h"
#include "scan/mesh_surface.h"
#include "support/mesh_reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>

namespace mrf_apps {

using namespace figures;
using nlohmann::json;
using pcl::mrf::Execution;
using pcl::mrf::Prior;

namespace {

/// Of the holes, % of the diagonal.
constexpr double holeRadius = 17;

struct FillingMethod {
  std::string id, title;
  std::function<SurfaceMesh(const pcl::mrf::scan::Points&, Execution&)> run;
};

FillingMethod ours(const std::string& id, const std::string& title, const pcl::mrf::Options& options)
{
  return {id, title, [options](const pcl::mrf::scan::Points& points, Execution& execution) {
            return toSurfaceMesh(reconstruct(points.positions, points.normals, options, execution));
          }};
}

std::vector<FillingMethod> methods()
{
  std::vector<FillingMethod> result;
  pcl::mrf::Options options;
  for (const Prior prior : allPriors) {
    options.prior.kind = prior;
    result.push_back(ours("k" + std::to_string(order(prior)), nameOf(prior), options));
  }
  // What bulges out of a narrow volume runs into its border, and is trimmed as an extrapolation.
  options.multiscale.padding = 24;
  const std::string words = std::to_string(options.multiscale.padding) + " voxels of padding";
  result.push_back(ours("wide", "k = 3, " + words, options));
  result.push_back({"poisson", "pcl::Poisson, depth 8", [](const pcl::mrf::scan::Points& points, Execution&) {
                      return poisson(points.positions, points.normals, 8);
                    }});
  return result;
}

struct HoledObject {
  std::string id, title;
  std::shared_ptr<const pcl::mrf::scan::Surface> surface;
};

std::vector<HoledObject> holedObjects(const ExperimentOptions& options)
{
  std::vector<HoledObject> result;
  const auto addMesh = [&](const std::string& id, const SurfaceMesh& mesh) {
    result.push_back({id, id, std::make_shared<pcl::mrf::scan::MeshSurface>(mesh.vertices, mesh.triangles)});
  };
  if (const auto mesh = bunny())
    addMesh("bunny", *mesh);
  for (const char* name : {"igea", "nefertiti"}) {
    const std::string path = options.data + "/reference/" + name + ".ply";
    if (!options.data.empty() && std::filesystem::exists(path))
      addMesh(name, readMesh(path));
  }
  for (const char* shape : {"torus:major=1,minor=.5", "box:x=2,y=1.5,z=1,rounding=.3"})
    result.push_back({std::string(shape).substr(0, std::string(shape).find(':')), shape,
                      std::make_shared<pcl::mrf::scan::AnalyticSurface>(pcl::mrf::scan::makeShape(shape))});
  return result;
}

/// Everything is seen, apart from one hole. \param center none: at random
pcl::mrf::scan::Scan scanWithHole(const HoledObject& object, std::uint64_t seed,
                                  const std::optional<Eigen::Vector3d>& center, Laboratory& laboratory)
{
  pcl::mrf::scan::ScanOptions options;
  options.views.count = 0;
  options.sampling.points = laboratory.options().quick ? 8000 : 28000;
  options.smallestHole.value = options.largestHole.value = holeRadius;
  if (center)
    options.holeCenters.push_back(*center);
  else
    options.holes = 1;
  options.seed = seed;
  return simulateScan(*object.surface, options, laboratory.execution());
}

json measureHole(const SurfaceMesh& mesh, const pcl::mrf::scan::Scan& scan, Execution& execution)
{
  const Statistics errors = summarize(SurfaceDistance(mesh).distances(scan.heldOut.positions, execution));
  const double percent = 100 / scan.diagonal;
  return {{"points", errors.count},
          {"rms", percent * errors.rms},
          {"percentile95", percent * errors.percentile95},
          {"max", percent * errors.max}};
}

/// The bunny's haunch and back, looked at from in front of it.
void addPictured(Laboratory& laboratory, Section& section)
{
  const auto truth = bunny();
  if (!truth)
    return;
  const HoledObject object{"bunny", "bunny",
                           std::make_shared<pcl::mrf::scan::MeshSurface>(truth->vertices, truth->triangles)};
  Lazy<pcl::mrf::scan::Scan> scan(
      [&] { return scanWithHole(object, laboratory.options().seed, Eigen::Vector3d(.5, .28, .36), laboratory); });
  constexpr double limitPercent = 3;
  PictureOptions picture;
  picture.width = picture.height = 700;
  picture.from = {.85, .55, 1};
  picture.focus = Eigen::Vector3d(.1, -.05, 0);
  picture.extent = 2.6;
  PictureOptions pictureOfPoints = picture;
  picture.legend = errorLegend("distance to the true surface, % of the diagonal", limitPercent);

  Table table{"fig-5",
              "The hole in the pictures: error of its held-out points, % of the diagonal",
              {"method", "points", "RMS", "95 %", "largest"},
              {}};
  laboratory.draw("fig-5-points.png", pictureOfPoints,
                  [&] { return facingDiscs(scan().cloud, pictureOfPoints.from, .75 * scan().spacing); });
  section.pictures.push_back({"fig-5-points.png", "the points that face the viewer"});
  for (const FillingMethod& method : methods()) {
    Lazy<SurfaceMesh> mesh([&] { return method.run(scan().cloud, laboratory.execution()); });
    const json measured = laboratory.measure("fig-5/pictured/" + method.id,
                                             [&] { return measureHole(mesh(), scan(), laboratory.execution()); });
    if (measured.contains("failed")) {
      table.rows.push_back({method.title, measured["failed"]});
      continue;
    }
    table.rows.push_back({method.title, measured["points"], rounded(measured["rms"]), rounded(measured["percentile95"]),
                          rounded(measured["max"])});
    const std::string file = "fig-5-" + method.id + ".png";
    laboratory.draw(file, picture, [&] {
      SurfaceMesh colored = mesh();
      colorFillings(scan(), SurfaceDistance(*truth).distances(colored.vertices, laboratory.execution()), limitPercent,
                    colored, laboratory.execution());
      return colored;
    });
    section.pictures.push_back({file, method.title + ": RMS error " + text(measured["rms"]) + " % of the diagonal"});
  }
  section.tables.push_back(table);
}

void addManyHoles(Laboratory& laboratory, Section& section)
{
  const int holes = laboratory.options().quick ? 1 : 6;
  const std::vector<HoledObject> all = holedObjects(laboratory.options());
  const std::vector<FillingMethod> allMethods = methods();
  Table table{"fig-5-holes",
              "Large holes at random places, one per scan: RMS error of their held-out points, % of the diagonal",
              {"object", "holes", "method", "median", "worst"},
              {}};
  std::vector<std::vector<double>> pooled(allMethods.size());
  const auto addRows = [&](const std::string& title, std::size_t count,
                           const std::vector<std::vector<double>>& errors) {
    for (std::size_t m = 0; m < allMethods.size(); ++m) {
      const Statistics statistics = summarize(errors[m]);
      const auto cell = [&](double value) { return statistics.count > 0 ? json(rounded(value)) : json(); };
      table.rows.push_back({title, count, allMethods[m].title, cell(statistics.median), cell(statistics.max)});
    }
  };
  std::size_t total = 0;
  for (const HoledObject& object : all) {
    std::vector<std::vector<double>> errors(allMethods.size());
    for (int hole = 0; hole < holes; ++hole) {
      // Another stream of places than the neighboring seeds of a user's own runs.
      const std::uint64_t seed = laboratory.options().seed * 1000 + static_cast<std::uint64_t>(hole);
      Lazy<pcl::mrf::scan::Scan> scan([&] { return scanWithHole(object, seed, std::nullopt, laboratory); });
      for (std::size_t m = 0; m < allMethods.size(); ++m) {
        const json measured =
            laboratory.measure("fig-5/" + object.id + "/" + std::to_string(hole) + "/" + allMethods[m].id, [&] {
              return measureHole(allMethods[m].run(scan().cloud, laboratory.execution()), scan(),
                                 laboratory.execution());
            });
        if (measured.contains("failed"))
          continue;
        errors[m].push_back(measured["rms"]);
        pooled[m].push_back(measured["rms"]);
      }
      ++total;
    }
    addRows(object.title, static_cast<std::size_t>(holes), errors);
  }
  addRows("all", total, pooled);
  section.tables.push_back(table);
}

} // namespace

Section fig5(Laboratory& laboratory)
{
  Section section{"fig-5", "Fig. 5: a large hole", {}, {}, {}, {}};
  section.paragraphs = {
      "Points all over an object, with exact normals, apart from a spherical hole with a radius of " +
          text(holeRadius) +
          " % of the diagonal. Default options with each of the three priors, beside pcl::Poisson with a depth of 8 "
          "and otherwise its own defaults. The points that the hole took away are the truth: the error is their "
          "distance to the surface. The default with a wider volume around the points shows how much of its error "
          "comes from the volume's border.",
      "In the pictures, surface within three mean spacings of a point is gray; what was filled in is colored by its "
      "distance to the true surface. In the table of random holes one hole is one scan; a hole this large takes "
      "features with it that no prior can know, so the worst figures are more about the object than about the method.",
      "The paper's figure shows the same: the membrane spans the hole like a soap film, the thin plate continues the "
      "slope of its rim, and Poisson closes it in its own way."};
  addPictured(laboratory, section);
  addManyHoles(laboratory, section);
  return section;
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "evaluate/surface_distance.h"
#include "evaluate/surface_samples.h"
#include "figure_support.h"
#include "figures.h"
#include "levels/multiscale.h"
#include "methods.h"
#include "program.h"
#include "scan/mesh_surface.h"

#include <algorithm>
#include <utility>

namespace mrf_apps {

using namespace figures;
using nlohmann::json;
using pcl::mrf::Execution;
using pcl::mrf::Options;
using pcl::mrf::scan::Length;
using pcl::mrf::scan::ScanOptions;

namespace {

enum class Coloring { plain, confidence };

/// Options, as the command line names them. Lengths are known once the scan is.
struct Variant {
  std::string id, words;
  Change apply;
};

/// A kind of scan and what to do about it.
struct Case {
  std::string id, title;
  ScanOptions scan;
  bool hasNormals;
  Coloring coloring;
  Eigen::Vector3d from; ///< where the pictures are taken
  std::vector<Variant> variants;
};

const Variant byDefault{"default", "default", [](Options&, double) {}};

std::vector<Case> cases(const ExperimentOptions& experiment)
{
  ScanOptions scan;
  scan.sampling.points = experiment.quick ? 8000 : 28000;
  scan.seed = experiment.seed;
  const Eigen::Vector3d front(.35, .3, 1);
  std::vector<Case> result;

  ScanOptions holes = scan;
  holes.views.count = 8;
  holes.holeCenters = {{.45, .32, .4}, {-.75, .25, .35}, {0, -.45, .7}};
  holes.smallestHole = holes.largestHole = {6, Length::Unit::diagonalPercent};
  const Change polygonized = [](Options& options, double) { options.remesher.rounds = 0; };
  result.push_back({"holes",
                    "scan with holes",
                    holes,
                    true,
                    Coloring::confidence,
                    front,
                    {byDefault,
                     {"no-remesh", "--no-remesh", polygonized},
                     {"thin-plate", "--no-remesh --prior thin-plate",
                      [=](Options& options, double spacing) {
                        polygonized(options, spacing);
                        options.prior.kind = pcl::mrf::Prior::thinPlate;
                      }},
                     {"draft", "--no-remesh --quality draft", [=](Options& options, double spacing) {
                        polygonized(options, spacing);
                        options.multiscale.quality = pcl::mrf::Quality::draft;
                      }}}});

  ScanOptions noisy = scan;
  noisy.noise = {1, Length::Unit::spacings};
  result.push_back({"noisy",
                    "noise of one mean spacing, normals estimated with the sensors known",
                    noisy,
                    false,
                    Coloring::plain,
                    front,
                    {{"voxels", "--observation plane",
                      [](Options& options, double) { options.observation.kind = pcl::mrf::ObservationKind::plane; }},
                     byDefault}});

  ScanOptions clusters = scan;
  clusters.clusteredOutliers = 3;
  result.push_back(
      {"clusters",
       "3 % false matches in clusters of " + std::to_string(clusters.clusterSize),
       clusters,
       true,
       Coloring::plain,
       front,
       {byDefault, {"robust", "--robust", [](Options& options, double) { options.outliers.robust = true; }}}});

  ScanOptions sparse = scan;
  sparse.sampling.points = 2000;
  result.push_back({"sparse",
                    "2,000 points",
                    sparse,
                    true,
                    Coloring::plain,
                    front,
                    {byDefault, {"fine", "--quality fine", [](Options& options, double) {
                                   options.multiscale.quality = pcl::mrf::Quality::fine;
                                 }}}});

  ScanOptions open = scan;
  open.views.placement = pcl::mrf::scan::Placement::front;
  open.views.count = 3;
  open.views.fan = 70;
  result.push_back(
      {"open",
       "scan from the front only",
       open,
       true,
       Coloring::confidence,
       {1.5, .5, .2},
       {{"none", "--trim none", [](Options& options, double) { options.trimming.kind = pcl::mrf::Trimming::none; }},
        byDefault,
        {"supported", "--trim supported",
         [](Options& options, double) { options.trimming.kind = pcl::mrf::Trimming::supported; }}}});

  ScanOptions large = scan;
  large.views.count = 0;
  large.holeCenters = {{.5, .28, .36}};
  large.smallestHole = large.largestHole = {22, Length::Unit::diagonalPercent};
  result.push_back({"large-hole",
                    "hole with a radius of 22 % of the diagonal",
                    large,
                    true,
                    Coloring::confidence,
                    {.85, .55, 1},
                    {byDefault,
                     {"tight", "--padding " + std::to_string(pcl::mrf::minPadding),
                      [](Options& options, double) { options.multiscale.padding = pcl::mrf::minPadding; }},
                     {"membrane", "--prior membrane",
                      [](Options& options, double) { options.prior.kind = pcl::mrf::Prior::membrane; }}}});
  return result;
}

struct Run {
  pcl::mrf::Reconstruction reconstruction;
  double processorSeconds;
};

Run run(const Case& one, const Variant& variant, const pcl::mrf::scan::Scan& scan, Execution& execution)
{
  Options options;
  variant.apply(options, scan.spacing);
  const Stopwatch watch;
  pcl::mrf::Reconstruction result = reconstruct(scan, one.hasNormals, options, execution);
  return {std::move(result), watch.processorSeconds()};
}

/// Distances in % of the diagonal: known places of the true surface to the mesh, and of the mesh to the truth.
json measure(const Run& result, const pcl::mrf::scan::Scan& scan, const SurfaceMesh& truth, Laboratory& laboratory)
{
  Execution& execution = laboratory.execution();
  const SurfaceMesh mesh = toSurfaceMesh(result.reconstruction);
  const double percent = 100 / scan.diagonal;
  const SurfaceDistance toMesh(mesh);
  const Places samples = sampleSurface(mesh, 50000, laboratory.options().seed).positions;
  const std::vector<double> support = distancesToPoints(samples, scan.cloud.positions, execution);
  const auto far = std::count_if(support.begin(), support.end(), [&](double d) { return d > 3 * scan.spacing; });
  const auto rms = [&](const SurfaceDistance& surface, const Places& places) {
    return percent * summarize(surface.distances(places, execution)).rms;
  };
  json measured{{"clean", rms(toMesh, scan.clean.positions)},
                {"truth", rms(SurfaceDistance(truth), samples)},
                {"unsupported", 100 * static_cast<double>(far) / static_cast<double>(samples.size())},
                {"components", result.reconstruction.report.mesh.components},
                {"processorSeconds", result.processorSeconds}};
  if (scan.heldOut.size() > 0)
    measured["heldOut"] = rms(toMesh, scan.heldOut.positions);
  return measured;
}

SurfaceMesh colored(const Case& one, const pcl::mrf::Reconstruction& result)
{
  SurfaceMesh mesh = toSurfaceMesh(result);
  if (one.coloring == Coloring::confidence)
    colorByConfidence(mesh);
  return mesh;
}

} // namespace

Section guide(Laboratory& laboratory)
{
  Section section{"guide", "What the options are for", {}, {}, {}, {}};
  const auto truth = bunny();
  if (!truth) {
    section.paragraphs.push_back(
        "Nothing was measured: Debian's package glmark2-data with the bunny is not installed.");
    return section;
  }
  section.paragraphs = {
      "Simulated scans of one object, each with the trait that calls for an option: with the defaults, and with what "
      "helps. Distances are root mean squares in % of the diagonal: from the noise-free points to the surface, from "
      "points that a hole took away to the surface, and from the surface to the object. Surface without data lies "
      "farther than three mean spacings from every point.",
      "In pictures with two colors, blue is surface without data. One object says which way an option works, not how "
      "much it gains on another."};
  Table table{"guide",
              "Options against traits of the scan",
              {"scan", "options", "points to surface", "held-out points to surface", "surface to object",
               "surface without data, %", "components", "CPU s"},
              {}};
  const pcl::mrf::scan::MeshSurface object(truth->vertices, truth->triangles);
  for (const Case& one : cases(laboratory.options())) {
    Lazy<pcl::mrf::scan::Scan> scan([&] { return simulateScan(object, one.scan, laboratory.execution()); });
    PictureOptions picture;
    picture.width = picture.height = 600;
    picture.from = one.from;
    picture.focus = Eigen::Vector3d(0, 0, 0);
    picture.extent = 2.45;
    const std::string points = "guide-" + one.id + "-points.png";
    laboratory.draw(points, picture, [&] {
      return facingDiscs(scan().cloud, one.from, (one.id == "sparse" ? .5 : .75) * scan().spacing);
    });
    section.pictures.push_back({points, one.title + ": the points that face the viewer"});
    for (const Variant& variant : one.variants) {
      Lazy<Run> result([&] { return run(one, variant, scan(), laboratory.execution()); });
      const json measured = laboratory.measure("guide/" + one.id + "/" + variant.id,
                                               [&] { return measure(result(), scan(), *truth, laboratory); });
      if (measured.contains("failed")) {
        table.rows.push_back({one.title, variant.words, measured["failed"]});
        continue;
      }
      table.rows.push_back({one.title, variant.words, rounded(measured["clean"]),
                            measured.contains("heldOut") ? json(rounded(measured["heldOut"])) : json(),
                            rounded(measured["truth"]), rounded(measured["unsupported"]), measured["components"],
                            rounded(measured["processorSeconds"], 2)});
      const std::string file = "guide-" + one.id + "-" + variant.id + ".png";
      laboratory.draw(file, picture, [&] { return colored(one, result().reconstruction); });
      section.pictures.push_back({file, one.title + ": " + variant.words});
    }
  }
  section.tables.push_back(table);
  return section;
}

} // namespace mrf_apps

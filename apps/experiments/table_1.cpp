// SPDX-License-Identifier: BSD-3-Clause
#include "comparisons.h"
#include "figure_support.h"
#include "patches.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace mrf_apps {

using figures::Lazy;
using figures::rounded;
using figures::text;
using nlohmann::json;
using pcl::mrf::scan::Scan;

namespace {

struct Measured {
  PatchScan scan;
  std::vector<json> results; ///< one per method
};

std::vector<Method> allMethods()
{
  std::vector<Method> methods = ownMethods();
  for (const Method& peer : peerMethods())
    methods.push_back(peer);
  return methods;
}

/// The hole that the first method fills worst.
struct WorstHole {
  std::size_t scan, hole;
  double rms;
};

std::optional<WorstHole> worstHole(const std::vector<Measured>& all)
{
  std::optional<WorstHole> worst;
  for (std::size_t s = 0; s < all.size(); ++s) {
    const json& result = all[s].results.front();
    if (result.contains("failed"))
      continue;
    for (std::size_t h = 0; h < result["holes"].size(); ++h)
      if (result["holes"][h].is_number() && (!worst || result["holes"][h].get<double>() > worst->rms))
        worst = WorstHole{s, h, result["holes"][h]};
  }
  return worst;
}

void addPictures(const std::vector<Measured>& all, const std::vector<Method>& methods, Laboratory& laboratory,
                 Section& section)
{
  const auto worst = worstHole(all);
  if (!worst || !laboratory.options().hasPictures)
    return;
  const Measured& shown = all[worst->scan];
  const Scan scan = simulate(shown.scan, laboratory);
  const pcl::mrf::scan::Hole& hole = scan.holes[worst->hole];
  // Seen against the normals of what was left out: from where the hole opens.
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  const std::vector<std::int32_t> owners = holesOf(scan.heldOut.positions, scan.holes);
  for (std::size_t i = 0; i < owners.size(); ++i)
    if (owners[i] == static_cast<std::int32_t>(worst->hole))
      from += scan.heldOut.normals[i];
  if (from.norm() < 1e-6)
    from = Eigen::Vector3d::UnitZ();
  PictureOptions picture;
  picture.width = picture.height = 600;
  picture.from = from.normalized();
  picture.up = std::abs(picture.from.y()) < .9 ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  picture.focus = hole.center;
  picture.extent = 5 * hole.radius;
  constexpr double limitPercent = 3;
  picture.legend = figures::errorLegend("distance to the object, % of the diagonal", limitPercent);

  const std::string stem = "table-1" + samplingSuffix(laboratory.options()) + "-worst-" + shown.scan.object.id + "-" +
                           std::to_string(shown.scan.index) + "-" + std::to_string(worst->hole) + "-";
  // Nothing of it shows an error; at the scale of the others.
  PictureOptions pictureOfTruth = picture;
  pictureOfTruth.legend = {};
  pictureOfTruth.height = static_cast<int>(std::lround((1 - legendHeight) * picture.height));
  laboratory.draw(stem + "truth.png", pictureOfTruth, [&] {
    Scan truth = scan;
    for (std::size_t i = 0; i < truth.heldOut.size(); ++i)
      truth.cloud.append(truth.heldOut, i);
    return figures::facingDiscs(truth.cloud, picture.from, .75 * scan.spacing);
  });
  section.pictures.push_back({stem + "truth.png", shown.scan.object.title + ": the points with those left out, which "
                                                                            "are the truth"});
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const json& result = shown.results[m];
    if (result.contains("failed") || !result["holes"][worst->hole].is_number())
      continue;
    const std::string file = stem + methods[m].id + ".png";
    laboratory.draw(file, picture, [&] {
      SurfaceMesh mesh = run(methods[m], scan.cloud, scan.spacing, laboratory.execution()).mesh;
      figures::colorFillings(scan, shown.scan.object.load().distances(mesh.vertices, laboratory.execution()),
                             limitPercent, mesh, laboratory.execution());
      return mesh;
    });
    section.pictures.push_back(
        {file, methods[m].title + ": RMS error " + text(result["holes"][worst->hole]) + " % of the diagonal"});
  }
}

/// The other method of the paper's table.
constexpr const char* missing = "MPU: not measured, as neither PCL nor CGAL nor a package of Debian has it";

Table summaryTable(const std::vector<Measured>& all, const std::vector<Method>& methods)
{
  Table table{"table-1", "Per object and over all: errors in % of the object's diagonal", {"object", "method"}, {}};
  for (const std::string& column : patchColumns())
    table.columns.push_back(column);
  std::vector<std::string> objects;
  for (const Measured& measured : all)
    if (std::find(objects.begin(), objects.end(), measured.scan.object.title) == objects.end())
      objects.push_back(measured.scan.object.title);
  objects.insert(objects.begin(), "all");
  for (const std::string& object : objects)
    for (std::size_t m = 0; m < methods.size(); ++m) {
      PatchResults results;
      for (const Measured& measured : all)
        if (object == "all" || measured.scan.object.title == object)
          results.add(measured.results[m]);
      std::vector<json> row = {object, methods[m].title};
      for (const json& cell : patchCells(results))
        row.push_back(cell);
      table.rows.push_back(row);
    }
  std::vector<json> row = {"all", missing};
  row.resize(table.columns.size());
  table.rows.push_back(row);
  return table;
}

/// Errors of the same holes by two methods; a hole counts where both were measured.
std::vector<Pair> pairs(const std::vector<Measured>& all, std::size_t a, std::size_t b)
{
  std::vector<Pair> result;
  for (std::size_t s = 0; s < all.size(); ++s)
    addPairs(all[s].results[a], all[s].results[b], static_cast<int>(s), result);
  return result;
}

Table pairedTable(const std::vector<Measured>& all, const std::vector<Method>& methods)
{
  Table table{
      "table-1-paired",
      "Hole by hole against " + methods.front().title,
      {"method", "holes", "better than ours in % of the holes", "median of its error / ours", "95 % from", "to"},
      {}};
  for (std::size_t m = 1; m < methods.size(); ++m) {
    const Comparison comparison = compare(pairs(all, m, 0), 1);
    if (comparison.pairs == 0)
      table.rows.push_back({methods[m].title, 0, json(), json(), json(), json()});
    else
      table.rows.push_back({methods[m].title, comparison.pairs, rounded(100 * comparison.shareBelow),
                            rounded(comparison.medianRatio), rounded(comparison.lower), rounded(comparison.upper)});
  }
  return table;
}

/// The errors of all holes in ascending order.
Plot errorPlot(const std::vector<Measured>& all, const std::vector<Method>& methods)
{
  Plot plot = figures::emptyPlot(Plot::Kind::lines, "table-1-holes", "All holes, in the order of their errors",
                                 "% of the holes", "RMS error, % of the diagonal");
  plot.logY = true;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    PatchResults results;
    for (const Measured& measured : all)
      results.add(measured.results[m]);
    if (results.holes.empty())
      continue;
    Curve curve{methods[m].title, {}, results.holes};
    std::sort(curve.y.begin(), curve.y.end());
    for (std::size_t i = 0; i < curve.y.size(); ++i)
      curve.x.push_back(100 * (static_cast<double>(i) + .5) / static_cast<double>(curve.y.size()));
    plot.curves.push_back(curve);
  }
  return plot;
}

} // namespace

Section table1(Laboratory& laboratory)
{
  const bool isQuick = laboratory.options().quick;
  const int scans = scansPerObject(laboratory.options());
  const std::vector<ScanObject> objects = patchObjects(laboratory.options());
  const std::vector<Method> methods = allMethods();

  std::vector<Measured> all;
  std::string names;
  for (const ScanObject& object : objects) {
    names += (names.empty() ? "" : ", ") + object.title + " (" + object.origin + ")";
    for (int index = 0; index < scans; ++index) {
      Measured measured{{object, index}, {}};
      Lazy<Scan> scan([&] { return simulate(measured.scan, laboratory); });
      for (const Method& method : methods)
        measured.results.push_back(
            laboratory.measure("table-1" + samplingSuffix(laboratory.options()) + "/" + object.id + "/" +
                                   std::to_string(index) + "/" + method.id,
                               [&] { return measurePatches(method, measured.scan, scan(), laboratory); }));
      all.push_back(std::move(measured));
    }
  }

  Section section{"table-1", "Table 1: leaving patches out", {}, {}, {}, {}};
  section.paragraphs = {
      "Objects: " + names + ".",
      "Each object is scanned " + std::to_string(scans) + (scans == 1 ? " time" : " times") +
          " by 12 simulated views with occlusion, about " + (isQuick ? "8,000" : "28,000") +
          " points with exact positions and normals (" + samplingTitle(laboratory.options()) + "), and loses " +
          std::to_string(holesPerScan) +
          " spherical patches at random places with radii of 4 to 10 % of its diagonal. The points that a patch took "
          "away are the truth there: a hole's error is the root mean square of their distances to the surface. "
          "Accuracy is that of all points that were left, whether a method used or dropped them. Surface farther than "
          "1 % of the diagonal from the object is "
          "invented. Both belong together: the error of a hole does not see surface that is too much, and sheets "
          "across a hole that happen to pass near its points make it small.",
      "All methods are given the same points with the same normals. Ours has its defaults apart from what the name "
      "says, and no remeshing. pcl::MarchingCubesHoppe has a grid 5 % larger than the points' box: without that, what "
      "PCL's tool does, it leaves out the sides of an object that lie in the box. Corners of its triangles that are "
      "equal but for rounding become one. Mesh flaws are non-manifold edges and vertices and degenerate triangles. "
      "CPU seconds are those of all threads. Ours leaves surface open where "
      "it would be an extrapolation; the others' is not trimmed.",
      "In the paired table each hole is filled by both methods; the interval is a bootstrap over scans, so that holes "
      "of one scan do not count as independent.",
      "The pictures show the hole that our default fills worst, by every method."};
  if (isQuick)
    section.paragraphs.push_back("Quick: two objects, one scan of each, fewer points; the full run has every object "
                                 "and at least 30 holes in each.");
  section.tables = {summaryTable(all, methods), pairedTable(all, methods)};
  section.plots = {errorPlot(all, methods)};
  addPictures(all, methods, laboratory, section);
  return section;
}

} // namespace mrf_apps

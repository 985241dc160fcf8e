// SPDX-License-Identifier: BSD-3-Clause
#include "evaluate/surface_distance.h"
#include "evaluate/surface_samples.h"
#include "figure_support.h"
#include "figures.h"
#include "observation/observation.h"
#include "scan/mesh_surface.h"
#include "support/mesh_reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

namespace mrf_apps {

using namespace figures;
using nlohmann::json;

namespace {

struct HoledSubject {
  std::string id, title;
  SurfaceMesh mesh; ///< the truth
};

std::vector<HoledSubject> subjects(const ExperimentOptions& options)
{
  std::vector<HoledSubject> result;
  if (const auto mesh = bunny())
    result.push_back({"bunny", "bunny", *mesh});
  const std::string igea = options.data + "/reference/igea.ply";
  if (!options.data.empty() && std::filesystem::exists(igea))
    result.push_back({"igea", "igea", readMesh(igea)});
  return result;
}

pcl::mrf::scan::Scan scanWithHoles(const HoledSubject& subject, Laboratory& laboratory)
{
  pcl::mrf::scan::ScanOptions options;
  options.sampling.points = laboratory.options().quick ? 8000 : 28000;
  options.holes = 3;
  options.smallestHole.value = 6;
  options.largestHole.value = 9;
  options.seed = laboratory.options().seed;
  return simulateScan(pcl::mrf::scan::MeshSurface(subject.mesh.vertices, subject.mesh.triangles), options,
                      laboratory.execution());
}

/// Lower bounds of the classes of confidence; the first holds the surface without data.
constexpr double classBounds[] = {0, 1e-6, .5, .75, .9, .95};

std::string classNames(std::size_t index)
{
  if (index == 0)
    return "0 (no data)";
  const std::string lower = index == 1 ? "0" : text(classBounds[index]);
  const std::string upper = index + 1 < std::size(classBounds) ? text(classBounds[index + 1]) : "1";
  return lower + " – " + upper;
}

/// Triangles of the reference at its border: what is closest to them may lie beside the known surface.
std::vector<bool> trianglesAtBorder(const SurfaceMesh& mesh)
{
  std::map<std::pair<std::int32_t, std::int32_t>, int> uses;
  const auto edge = [&](std::size_t t, std::size_t corner) {
    const std::int32_t a = mesh.triangles[t][corner], b = mesh.triangles[t][(corner + 1) % 3];
    return std::make_pair(std::min(a, b), std::max(a, b));
  };
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t corner = 0; corner < 3; ++corner)
      ++uses[edge(t, corner)];
  std::vector<bool> isBorderVertex(mesh.vertices.size(), false);
  for (const auto& [ends, count] : uses)
    if (count == 1)
      isBorderVertex[static_cast<std::size_t>(ends.first)] = isBorderVertex[static_cast<std::size_t>(ends.second)] =
          true;
  std::vector<bool> result;
  for (const auto& [a, b, c] : mesh.triangles)
    result.push_back(isBorderVertex[static_cast<std::size_t>(a)] || isBorderVertex[static_cast<std::size_t>(b)] ||
                     isBorderVertex[static_cast<std::size_t>(c)]);
  return result;
}

/// Confidence at a place of a triangle, linear between the corners.
double confidenceAt(const SurfaceMesh& mesh, std::int32_t triangle, const Eigen::Vector3d& place)
{
  const auto& corners = mesh.triangles[static_cast<std::size_t>(triangle)];
  const Eigen::Vector3d a = mesh.vertices[static_cast<std::size_t>(corners[0])];
  const Eigen::Vector3d u = mesh.vertices[static_cast<std::size_t>(corners[1])] - a,
                        v = mesh.vertices[static_cast<std::size_t>(corners[2])] - a, w = place - a;
  const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), determinant = uu * vv - uv * uv;
  const double s = (vv * u.dot(w) - uv * v.dot(w)) / determinant, t = (uu * v.dot(w) - uv * u.dot(w)) / determinant;
  const auto at = [&](std::size_t corner) { return mesh.confidences[static_cast<std::size_t>(corners[corner])]; };
  return (1 - s - t) * at(0) + s * at(1) + t * at(2);
}

/// Share of the area and error per class.
json measureClasses(const HoledSubject& subject, const pcl::mrf::Reconstruction& result, Laboratory& laboratory)
{
  const SurfaceMesh mesh = toSurfaceMesh(result);
  const SurfaceSamples samples =
      sampleSurface(mesh, laboratory.options().quick ? 50000 : 200000, laboratory.options().seed);
  const std::vector<ClosestPlace> places =
      SurfaceDistance(subject.mesh).closest(samples.positions, laboratory.execution());
  const std::vector<bool> atBorder = trianglesAtBorder(subject.mesh);
  constexpr std::size_t classes = std::size(classBounds);
  std::vector<std::vector<double>> errors(classes);
  std::vector<std::int64_t> counts(classes, 0);
  std::int64_t unknown = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double confidence = confidenceAt(mesh, samples.triangles[i], samples.positions[i]);
    std::size_t index = classes - 1;
    while (index > 0 && confidence < classBounds[index])
      --index;
    ++counts[index];
    if (atBorder[static_cast<std::size_t>(places[i].triangle)])
      ++unknown;
    else
      errors[index].push_back(places[i].distance);
  }
  const auto all = static_cast<double>(places.size());
  const double percent = 100 / result.report.diagonal;
  json measured{{"unknown", 100 * static_cast<double>(unknown) / all}, {"classes", json::array()}};
  for (std::size_t index = 0; index < classes; ++index) {
    const Statistics statistics = summarize(std::move(errors[index]));
    measured["classes"].push_back({{"share", 100 * static_cast<double>(counts[index]) / all},
                                   {"rms", percent * statistics.rms},
                                   {"percentile95", percent * statistics.percentile95},
                                   {"max", percent * statistics.max}});
  }
  return measured;
}

} // namespace

Section fig4(Laboratory& laboratory)
{
  Section section{"fig-4", "Fig. 4: confidence on the surface", {}, {}, {}, {}};
  section.paragraphs = {
      "A simulated scan from twelve sides with occlusion and three more holes of 6 to 9 % of the diagonal in radius, "
      "reconstructed with default options. Every vertex carries the local confidence α: 1 on a data point, falling "
      "with the distance to the nearest one, and 0 where the prior alone made the surface.",
      "The table shows what α says about the error: the distance from evenly spread samples of the surface to the mesh "
      "that was scanned. Samples whose closest place is at that mesh's border have a share of the area but no error, "
      "because the truth is not known there. The paper's figure shows the same coloring."};
  Plot plot = emptyPlot(Plot::Kind::bars, "fig-4", "Error by confidence", "class of confidence (0: no data)",
                        "RMS error, % of diagonal");
  plot.logY = true;
  for (const HoledSubject& subject : subjects(laboratory.options())) {
    Lazy<pcl::mrf::Reconstruction> result([&] {
      const pcl::mrf::scan::Scan scan = scanWithHoles(subject, laboratory);
      return reconstruct(scan.cloud.positions, scan.cloud.normals, {}, laboratory.execution());
    });
    const json measured =
        laboratory.measure("fig-4/" + subject.id, [&] { return measureClasses(subject, result(), laboratory); });
    if (measured.contains("failed")) {
      section.paragraphs.push_back(subject.title + ": " + measured["failed"].get<std::string>());
      continue;
    }
    Table table{"fig-4-" + subject.id,
                subject.title + ": error by confidence (no truth for " + text(measured["unknown"]) + " % of the area)",
                {"confidence α", "area, %", "RMS, % of diagonal", "95 %", "largest"},
                {}};
    Curve curve{subject.title, {}, {}};
    for (std::size_t index = 0; index < measured["classes"].size(); ++index) {
      const json& entry = measured["classes"][index];
      table.rows.push_back({classNames(index), rounded(entry["share"]), rounded(entry["rms"]),
                            rounded(entry["percentile95"]), rounded(entry["max"])});
      curve.x.push_back(static_cast<double>(index));
      curve.y.push_back(entry["rms"]);
    }
    plot.curves.push_back(curve);
    section.tables.push_back(table);

    PictureOptions picture;
    picture.width = picture.height = 800;
    picture.legend = confidenceLegend();
    const std::string file = "fig-4-" + subject.id + ".png";
    laboratory.draw(file, picture, [&] {
      SurfaceMesh mesh = toSurfaceMesh(result());
      colorByConfidence(mesh);
      return mesh;
    });
    section.pictures.push_back({file, subject.title + ", colored by α"});
  }
  if (section.tables.empty())
    section.paragraphs.push_back(
        "Nothing was measured: Debian's package glmark2-data with the bunny is not installed.");
  else
    section.plots.push_back(plot);
  return section;
}

} // namespace mrf_apps

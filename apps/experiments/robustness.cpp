// SPDX-License-Identifier: BSD-3-Clause
#include "comparisons.h"
#include "figure_support.h"
#include "mesh/self_intersection.h"
#include "random_scans.h"

#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <algorithm>
#include <map>

namespace mrf_apps {

using namespace figures;
using nlohmann::json;
using pcl::mrf::Execution;
using pcl::mrf::Reconstruction;

std::vector<std::string> faultsOf(const Reconstruction& result, Execution& execution)
{
  const pcl::mrf::TriangleMesh& mesh = result.mesh;
  const pcl::mrf::MeshStatistics statistics = pcl::mrf::measure(mesh);
  std::vector<std::string> faults;
  const auto count = [&](std::int64_t number, const std::string& what) {
    if (number > 0)
      faults.push_back(std::to_string(number) + " " + what);
  };
  if (mesh.triangles.empty())
    faults.emplace_back("no triangles");
  count(statistics.nonManifoldEdges, "edges that are not manifold or not consistently oriented");
  count(statistics.nonManifoldVertices, "non-manifold vertices");
  count(statistics.degenerateTriangles, "degenerate triangles");
  count(statistics.unusedVertices, "unused vertices");
  count(static_cast<std::int64_t>(pcl::mrf::selfIntersectingTriangles(mesh, execution).size()),
        "triangles that intersect others");
  // Trimming an extrapolation leaves an opening; whole components leave none.
  if (result.report.trimming.extrapolationsDropped == 0)
    count(statistics.boundaryLoops, "openings, though nothing was trimmed");
  if (statistics.closed() && !(statistics.volume > 0))
    faults.emplace_back("closed, but inside out");
  if (mesh.normals.size() != mesh.vertices.size() || mesh.confidences.size() != mesh.vertices.size())
    faults.emplace_back("fields that do not match the vertices");
  return faults;
}

namespace {

json check(const RandomScan& random, Execution& execution)
{
  const pcl::mrf::scan::Scan scan = simulateScan(*random.load(), random.options, execution);
  const Reconstruction result = reconstruct(scan, random.hasNormals, pcl::mrf::Options(), execution);
  const pcl::mrf::MeshStatistics statistics = pcl::mrf::measure(result.mesh);
  return {{"faults", faultsOf(result, execution)},     {"triangles", statistics.triangles},
          {"components", statistics.components},       {"closed", statistics.closed()},
          {"meanQuality", statistics.meanQuality},     {"minQuality", statistics.minQuality},
          {"regularShare", statistics.regularShare()}, {"refused", result.report.remesher.refusedOperations}};
}

/// Of the scans of one kind of object.
struct Group {
  int scans = 0, clean = 0, closed = 0;
  double quality = 0, regular = 0, min = 1; ///< the first two are sums over the meshes
  int meshes = 0;

  void add(const json& measured)
  {
    ++scans;
    if (measured.contains("failed"))
      return;
    ++meshes;
    clean += measured["faults"].empty() ? 1 : 0;
    closed += measured["closed"].get<bool>() ? 1 : 0;
    quality += measured["meanQuality"].get<double>();
    regular += measured["regularShare"].get<double>();
    min = std::min(min, measured["minQuality"].get<double>());
  }

  std::vector<json> cells() const
  {
    const auto mean = [&](double sum) { return meshes > 0 ? json(rounded(sum / meshes)) : json(); };
    return {scans, clean, closed, mean(quality), meshes > 0 ? json(rounded(min)) : json(), mean(regular)};
  }
};

std::string joined(const json& words)
{
  std::string result;
  for (const json& word : words)
    result += (result.empty() ? "" : "; ") + word.get<std::string>();
  return result;
}

} // namespace

Section robustness(Laboratory& laboratory)
{
  const int count = laboratory.options().quick ? 12 : 100;
  Group all;
  std::map<std::string, Group> byObject;
  Table failures{"robustness-failures", "Meshes with faults, and what repeats them", {"scan", "fault", "repeat"}, {}};
  for (int index = 0; index < count; ++index) {
    const RandomScan random = randomScan(laboratory.options().seed, index);
    const std::string key = "robustness/" + std::to_string(index);
    const json measured = laboratory.measure(key, [&] { return check(random, laboratory.execution()); });
    all.add(measured);
    byObject[random.kind].add(measured);
    const std::string fault =
        measured.contains("failed") ? measured["failed"].get<std::string>() : joined(measured["faults"]);
    if (!fault.empty())
      failures.rows.push_back({index, fault, random.commands()});
  }

  Table table{"robustness",
              "Meshes of random scans",
              {"object", "scans", "without fault", "closed", "mean quality", "lowest quality of a triangle",
               "share of vertices with 6 edges"},
              {}};
  const auto addRow = [&](const std::string& title, const Group& group) {
    std::vector<json> row = {title};
    for (const json& cell : group.cells())
      row.push_back(cell);
    table.rows.push_back(row);
  };
  for (const auto& [kind, group] : byObject)
    addRow(kind, group);
  addRow("all", all);

  Section section{"robustness", "Meshes of random scans", {}, {}, {}, {}};
  section.paragraphs = {
      std::to_string(count) +
          " scans drawn at random: object, its proportions, size and rotation; 3,000 to 5,000 points; noise of 0 to 1 "
          "mean spacing; 0 to 3 % outliers; 0 to 4 holes; misaligned views; half of them without normals, which are "
          "then estimated and face their sensors. Each is reconstructed with the default options, remeshing included.",
      "A mesh is without fault if every edge and every vertex is manifold, neighboring triangles agree on the "
      "orientation, no triangle is degenerate, none intersects another (exact predicates), closed meshes are not "
      "inside out, and a mesh is closed unless an extrapolation was trimmed. Accuracy is not judged here: some of "
      "these scans do not determine their object. Quality is twice the ratio of the radii of a triangle's inner and "
      "outer circle.",
      failures.rows.empty() ? "All " + std::to_string(all.clean) + " meshes are without fault."
                            : std::to_string(all.clean) + " of " + std::to_string(all.scans) +
                                  " meshes are without fault; the table of the others has the commands that repeat "
                                  "them."};
  section.tables.push_back(table);
  if (!failures.rows.empty())
    section.tables.push_back(failures);
  return section;
}

} // namespace mrf_apps

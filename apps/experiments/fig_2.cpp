// SPDX-License-Identifier: BSD-3-Clause
#include "evaluate/evaluation_report.h"
#include "figure_support.h"
#include "figures.h"
#include "remesher/remesher.h"
#include "scan/analytic_surface.h"

#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cmath>

namespace mrf_apps {

using namespace figures;
using nlohmann::json;
using pcl::mrf::Execution;

namespace {

/// Points to reconstruct, and where the close-up looks.
struct RemeshedSubject {
  std::string id, title;
  Places positions, normals;
  PictureOptions closeUp;
};

struct BeforeAndAfter {
  pcl::mrf::Reconstruction reconstruction; ///< with the polygonizer's mesh
  pcl::mrf::RemeshResult remeshed;
};

BeforeAndAfter remeshBoth(const RemeshedSubject& subject, Execution& execution)
{
  pcl::mrf::Options options;
  options.trimming.kind = pcl::mrf::Trimming::none;
  options.remesher.rounds = 0;
  BeforeAndAfter result;
  result.reconstruction = reconstruct(subject.positions, subject.normals, options, execution);
  result.remeshed = pcl::mrf::remesh(result.reconstruction.mesh, result.reconstruction.field, {}, execution);
  return result;
}

/// RMS of the distances from the zero level amid the triangles' edges, in voxels.
double offLevel(const pcl::mrf::TriangleMesh& mesh, const pcl::mrf::DistanceField& field)
{
  double sum = 0;
  for (const pcl::mrf::Triangle& t : mesh.triangles)
    for (std::size_t n = 0; n < 3; ++n) {
      const Eigen::Vector3f middle =
          (mesh.vertices[static_cast<std::size_t>(t[n])] + mesh.vertices[static_cast<std::size_t>(t[(n + 1) % 3])]) / 2;
      const double distance = field.sampleDistance(middle) / std::max(field.sampleGradient(middle).norm(), 1e-3f);
      sum += distance * distance;
    }
  return std::sqrt(sum / static_cast<double>(3 * mesh.triangles.size())) / field.lattice().spacing;
}

json measured(const pcl::mrf::TriangleMesh& mesh, const pcl::mrf::DistanceField& field, Execution& execution)
{
  json result = json::parse(toJson(evaluate(toSurfaceMesh(mesh, Eigen::Vector3d::Zero()), {}, {}, execution)).dump());
  result = result["mesh"];
  result["offLevel"] = offLevel(mesh, field);
  return result;
}

/// Checks of the mesh that fail; remeshing must not change the topology either.
int violations(const json& mesh, const json& before)
{
  int count = 0;
  for (const char* name : {"nonManifoldEdges", "nonManifoldVertices", "degenerateTriangles",
                           "selfIntersectingTriangles", "unusedVertices"})
    count += mesh[name].get<std::int64_t>() != 0;
  for (const char* name : {"components", "eulerCharacteristic", "boundaryLoops"})
    count += mesh[name] != before[name];
  return count;
}

std::vector<json> row(const std::string& title, const char* when, const json& mesh, const json& before)
{
  const double vertices = mesh["vertices"], regular = mesh["valences"][6];
  return {title,
          when,
          mesh["triangles"],
          rounded(mesh["meanQuality"], 4),
          rounded(mesh["minQuality"]),
          rounded(100 * regular / vertices, 4),
          rounded(mesh["areaVariance"]),
          rounded(mesh["offLevel"]),
          violations(mesh, before)};
}

/// The counts as percentages of their sum.
std::vector<double> shares(const json& bins, std::size_t begin, std::size_t end)
{
  double all = 0;
  for (const json& bin : bins)
    all += bin.get<double>();
  std::vector<double> result;
  for (std::size_t bin = begin; bin < end; ++bin)
    result.push_back(100 * bins[bin].get<double>() / all);
  return result;
}

Plot valencePlot(const RemeshedSubject& subject, const json& result)
{
  Plot plot = emptyPlot(Plot::Kind::bars, "fig-2-valence-" + subject.id,
                        subject.title + ": vertices by number of edges", "edges", "% of vertices");
  constexpr std::size_t first = 3, end = 11;
  for (const char* when : {"before", "after"}) {
    Curve curve{when, {}, shares(result[when]["valences"], first, end)};
    for (std::size_t valence = first; valence < end; ++valence)
      curve.x.push_back(static_cast<double>(valence));
    plot.curves.push_back(curve);
  }
  return plot;
}

Plot areaPlot(const RemeshedSubject& subject, const json& result)
{
  Plot plot = emptyPlot(Plot::Kind::bars, "fig-2-area-" + subject.id, subject.title + ": triangles by area",
                        "area / mean area (last bar: all above)", "% of triangles");
  for (const char* when : {"before", "after"}) {
    const json& areas = result[when]["areas"];
    Curve curve{when, {}, shares(areas, 0, areas.size())};
    for (std::size_t bin = 0; bin < areas.size(); ++bin)
      curve.x.push_back((static_cast<double>(bin) + .5) * Evaluation::areaStep);
    plot.curves.push_back(curve);
  }
  return plot;
}

std::vector<RemeshedSubject> subjects(Laboratory& laboratory)
{
  std::vector<RemeshedSubject> result;
  if (const auto mesh = bunny()) {
    RemeshedSubject subject{"bunny", "bunny (zippered scans)", mesh->vertices, {}, {}};
    subject.closeUp.focus = Eigen::Vector3d(-.52, .60, .25);
    subject.closeUp.extent = .42;
    subject.closeUp.from = {-.1, .15, 1};
    result.push_back(subject);
  }
  pcl::mrf::scan::ScanOptions options;
  options.views.count = 0;
  options.sampling.points = laboratory.options().quick ? 4000 : 12000;
  options.seed = laboratory.options().seed;
  const pcl::mrf::scan::AnalyticSurface surface(pcl::mrf::scan::makeShape("torus:major=1,minor=.4"));
  const pcl::mrf::scan::Scan scan = simulateScan(surface, options, laboratory.execution());
  RemeshedSubject torus{"torus", "torus", scan.cloud.positions, scan.cloud.normals, {}};
  torus.closeUp.focus = Eigen::Vector3d(1, 0, .4);
  torus.closeUp.extent = 24 * scan.spacing;
  torus.closeUp.from = {.3, -.4, 1};
  result.push_back(torus);
  return result;
}

} // namespace

Section fig2(Laboratory& laboratory)
{
  Section section{"fig-2", "Fig. 2: remeshing", {}, {}, {}, {}};
  section.paragraphs = {
      "The mesh that the polygonizer cuts out of the voxels, and the same after six rounds of remeshing: splits, "
      "collapses, flips towards six edges per vertex, relaxation in the tangent plane and a trace back to the zero "
      "level. Nothing is trimmed. The bunny's points are those of the zippered scans and come without normals.",
      "Quality is twice the inradius over the circumradius: 1 for an equilateral triangle. The area variance is "
      "relative to the square of the mean area. Checks violated counts, of eight, those that fail: non-manifold edges, "
      "non-manifold vertices, degenerate triangles, self-intersections, unused vertices, and a number of components, "
      "an Euler characteristic or a number of boundary loops other than before. The paper's figure shows the same "
      "histograms: valences gather at six and areas around one size."};
  Table table{"fig-2",
              "Meshes before and after remeshing",
              {"object", "mesh", "triangles", "mean quality", "least quality", "vertices with 6 edges, %",
               "area variance", "edges off the zero level, voxels RMS", "checks violated"},
              {}};
  for (const RemeshedSubject& subject : subjects(laboratory)) {
    Lazy<BeforeAndAfter> meshes([&] { return remeshBoth(subject, laboratory.execution()); });
    const json result = laboratory.measure("fig-2/" + subject.id, [&] {
      const BeforeAndAfter& both = meshes();
      return json{{"before", measured(both.reconstruction.mesh, both.reconstruction.field, laboratory.execution())},
                  {"after", measured(both.remeshed.mesh, both.reconstruction.field, laboratory.execution())}};
    });
    if (result.contains("failed")) {
      section.paragraphs.push_back(subject.title + ": " + result["failed"].get<std::string>());
      continue;
    }
    for (const char* when : {"before", "after"}) {
      table.rows.push_back(row(subject.title, when, result[when], result["before"]));
      const std::string file = "fig-2-" + subject.id + "-" + when + ".png";
      PictureOptions picture = subject.closeUp;
      picture.showEdges = true;
      picture.width = picture.height = 700;
      laboratory.draw(file, picture, [&] {
        const BeforeAndAfter& both = meshes();
        return toSurfaceMesh(when == std::string("before") ? both.reconstruction.mesh : both.remeshed.mesh,
                             both.reconstruction.points.offset);
      });
      section.pictures.push_back({file, subject.title + ", close-up " + when + " remeshing"});
    }
    section.plots.push_back(valencePlot(subject, result));
    section.plots.push_back(areaPlot(subject, result));
  }
  section.tables.push_back(table);
  return section;
}

} // namespace mrf_apps

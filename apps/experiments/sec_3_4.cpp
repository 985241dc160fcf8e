// SPDX-License-Identifier: BSD-3-Clause
#include "field/interpolation.h"
#include "field/prior.h"
#include "figure_support.h"
#include "figures.h"
#include "levels/multiscale.h"
#include "observation/observation.h"
#include "points/sampling_density.h"
#include "program.h"
#include "scan/analytic_surface.h"
#include "scan/mesh_surface.h"
#include "solver/linear_system.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/report.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace mrf_apps {

using namespace figures;
using nlohmann::json;
using pcl::mrf::Execution;
using pcl::mrf::Lattice;
using pcl::mrf::Prior;
using pcl::mrf::SolverMethod;

namespace {

using Field = std::vector<float>;

/// What a surface reconstruction needs, in voxel sides.
constexpr double accuracy = .01;

/// A place on the converged surface.
struct Crossing {
  Eigen::Vector3f position;
  double slope; ///< length of the gradient
};

/// One level's system with its solution.
struct Problem {
  Lattice lattice;
  pcl::mrf::LinearSystem system;
  Field interpolated; ///< the next coarser level's solution on this lattice
  std::vector<double> solution;
  double minEnergy = 0;
  std::vector<Crossing> crossings;
};

pcl::mrf::OrientedPoints scanPoints(Laboratory& laboratory)
{
  pcl::mrf::scan::ScanOptions options;
  options.sampling.points = laboratory.options().quick ? 5000 : 20000;
  options.holes = 3;
  options.seed = laboratory.options().seed;
  const auto mesh = bunny();
  std::unique_ptr<pcl::mrf::scan::Surface> surface;
  if (mesh)
    surface = std::make_unique<pcl::mrf::scan::MeshSurface>(mesh->vertices, mesh->triangles);
  else
    surface = std::make_unique<pcl::mrf::scan::AnalyticSurface>(pcl::mrf::scan::makeShape("torus:major=1,minor=.5"));
  const pcl::mrf::scan::Scan scan = simulateScan(*surface, options, laboratory.execution());
  pcl::mrf::OrientedPoints points;
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    points.positions.push_back(scan.cloud.positions[i].cast<float>());
    points.normals.push_back(scan.cloud.normals[i].cast<float>());
    points.origins.push_back(static_cast<std::uint32_t>(i));
  }
  return points;
}

/// RMS distance between the surface of a field and the converged one, voxels.
double surfaceError(const Problem& problem, const Field& values)
{
  const pcl::mrf::DistanceField field(problem.lattice, values, Field(values.size(), 0));
  double sum = 0;
  for (const Crossing& crossing : problem.crossings) {
    const double distance = field.sampleDistance(crossing.position) / crossing.slope;
    sum += distance * distance;
  }
  return std::sqrt(sum / static_cast<double>(problem.crossings.size())) / problem.lattice.spacing;
}

/// The places where lattice edges cross the zero level, with the slope of the field; where it is nearly flat, three
/// tenths of the median slope, so that a few places do not decide the mean.
std::vector<Crossing> findCrossings(const Lattice& lattice, const Field& values)
{
  const pcl::mrf::DistanceField field(lattice, values, Field(values.size(), 0));
  std::vector<Crossing> crossings;
  std::vector<double> slopes;
  const auto addEdge = [&](const Eigen::Vector3i& a, const Eigen::Vector3i& b) {
    if (!lattice.size.contains(b.x(), b.y(), b.z()))
      return;
    const float da = field.distance(a.x(), a.y(), a.z()), db = field.distance(b.x(), b.y(), b.z());
    if ((da < 0) == (db < 0))
      return;
    const float share = da / (da - db);
    const Eigen::Vector3f position =
        (1 - share) * lattice.position(a.x(), a.y(), a.z()) + share * lattice.position(b.x(), b.y(), b.z());
    slopes.push_back(field.sampleGradient(position).norm());
    crossings.push_back({position, slopes.back()});
  };
  for (int z = 0; z < lattice.size.z; ++z)
    for (int y = 0; y < lattice.size.y; ++y)
      for (int x = 0; x < lattice.size.x; ++x)
        for (int axis = 0; axis < 3; ++axis)
          addEdge({x, y, z}, Eigen::Vector3i(x, y, z) + Eigen::Vector3i::Unit(axis));
  const double min = .3 * summarize(slopes).median;
  for (Crossing& crossing : crossings)
    crossing.slope = std::max(crossing.slope, min);
  return crossings;
}

Problem makeProblem(Prior prior, Laboratory& laboratory)
{
  Execution& execution = laboratory.execution();
  const pcl::mrf::OrientedPoints points = scanPoints(laboratory);
  const auto search = pcl::mrf::makePointBins();
  search->setPoints(points.positions);
  pcl::mrf::PointSet plain;
  plain.positions = points.positions;
  const float spacing = estimateSamplingDensity(plain, *search, execution).spacing;
  const pcl::mrf::BoundingBox box = pcl::mrf::boundingBox(points.positions);
  pcl::mrf::MultiscaleOptions multiscale;
  const int side = laboratory.options().quick ? 36 : 48;
  multiscale.voxelSize = (box.upper - box.lower).maxCoeff() / static_cast<float>(side - 2 * multiscale.padding);
  const std::vector<Lattice> lattices = planLevels(box, multiscale.voxelSize, {}, multiscale);

  pcl::mrf::PriorOptions priorOptions;
  priorOptions.kind = prior;
  // The paper's solvers are of a diagonal data term.
  pcl::mrf::ObservationOptions observationOptions;
  observationOptions.kind = pcl::mrf::ObservationKind::plane;
  pcl::mrf::SolverOptions tight;
  tight.residualTolerance = 1e-12;
  tight.changeTolerance = 0;
  tight.maxIterations = 300;

  Problem problem;
  Field values;
  for (std::size_t level = 0; level < lattices.size(); ++level) {
    const Lattice& lattice = lattices[level];
    const float reach = std::max(resolvedMaxDistance(observationOptions, spacing, multiscale.voxelSize),
                                 static_cast<float>(1.5 * lattice.spacing));
    const pcl::mrf::Observation observation =
        observe(points, *search, lattice, spacing, reach, observationOptions, execution);
    values = level == 0 ? Field(static_cast<std::size_t>(lattice.size.count()), 0)
                        : pcl::mrf::interpolateCubic(values, lattices[level - 1], lattice, execution);
    auto system = pcl::mrf::assemble(observation, priorOptions);
    std::vector<double> solution(values.begin(), values.end());
    solve(system, tight, lattice.spacing, solution, execution);
    if (level + 1 == lattices.size()) {
      problem.lattice = lattice;
      problem.system = std::move(system);
      problem.interpolated = values;
      problem.solution = solution;
    }
    values.assign(solution.begin(), solution.end());
  }
  problem.minEnergy = energy(problem.system, problem.solution, execution);
  problem.crossings = findCrossings(problem.lattice, values);
  return problem;
}

/// Runs of one solver with more and more iterations, each from the start, until the surface stands still, more
/// iterations change nothing, or a run takes too long.
json measureSolver(const Problem& problem, SolverMethod method, bool isCold, Laboratory& laboratory)
{
  Execution& execution = laboratory.execution();
  const double longest = laboratory.options().quick ? .5 : 6;
  json runs = json::array();
  for (double target = 1;; target *= method == SolverMethod::multigrid ? 1.3 : 1.5) {
    pcl::mrf::SolverOptions options;
    options.method = method;
    options.residualTolerance = 1e-10;
    options.changeTolerance = 0;
    options.maxIterations = static_cast<int>(std::ceil(target));
    options.seed = laboratory.options().seed;
    std::vector<double> values(problem.interpolated.size(), 0);
    if (!isCold)
      values.assign(problem.interpolated.begin(), problem.interpolated.end());
    const Stopwatch watch;
    const pcl::mrf::SolveReport report = solve(problem.system, options, problem.lattice.spacing, values, execution);
    const double seconds = watch.processorSeconds();
    const double error = surfaceError(problem, Field(values.begin(), values.end()));
    const double above = energy(problem.system, values, execution) - problem.minEnergy;
    if (runs.empty() || report.iterations > runs.back()["iterations"].get<int>())
      runs.push_back({{"iterations", report.iterations},
                      {"seconds", seconds},
                      {"energy", std::max(above, 0.) / std::abs(problem.minEnergy)},
                      {"error", error}});
    const bool stoppedEarly = report.iterations < options.maxIterations;
    const bool isDone = error < .02 * accuracy || method == SolverMethod::cholesky || stoppedEarly;
    if (isDone || seconds > longest / 2 || (method == SolverMethod::multigrid && target > 200))
      return runs;
  }
}

const char* nameOf(SolverMethod method)
{
  switch (method) {
  case SolverMethod::multigrid:
    return "multigrid";
  case SolverMethod::icm:
    return "ICM";
  case SolverMethod::cg:
    return "conjugate gradients";
  case SolverMethod::cholesky:
    return "Cholesky";
  }
  return "?";
}

struct Entry {
  std::string name;
  json runs;
};

Curve curveOf(const Entry& entry, const char* x, const char* y)
{
  Curve curve{entry.name, {}, {}};
  for (const json& run : entry.runs) {
    // A logarithmic axis has no zero.
    if (!(run[y].get<double>() > 0))
      continue;
    curve.x.push_back(run[x]);
    curve.y.push_back(run[y]);
  }
  return curve;
}

void addPlots(Prior prior, const std::vector<Entry>& entries, Section& section)
{
  const std::string k = std::to_string(order(prior));
  const struct {
    const char *x, *xLabel, *y, *yLabel;
  } axes[] = {{"iterations", "iterations or sweeps", "energy", "energy above the minimum, relative"},
              {"seconds", "CPU s", "energy", "energy above the minimum, relative"},
              {"seconds", "CPU s", "error", "RMS distance to the converged surface, voxels"}};
  for (const auto& axis : axes) {
    Plot plot = emptyPlot(Plot::Kind::lines, "sec-3-4-k" + k + "-" + axis.y + "-" + axis.x,
                          std::string(figures::nameOf(prior)), axis.xLabel, axis.yLabel);
    plot.logX = plot.logY = true;
    for (const Entry& entry : entries)
      plot.curves.push_back(curveOf(entry, axis.x, axis.y));
    section.plots.push_back(plot);
  }
}

std::vector<json> row(Prior prior, bool isCold, SolverMethod method, const json& runs)
{
  std::vector<json> cells = {figures::nameOf(prior), isCold ? "cold" : "interpolated", nameOf(method)};
  const auto reached =
      std::find_if(runs.begin(), runs.end(), [](const json& run) { return run["error"].get<double>() <= accuracy; });
  if (reached == runs.end())
    cells.insert(cells.end(), {json(), json()});
  else
    cells.insert(cells.end(), {(*reached)["iterations"], rounded((*reached)["seconds"], 2)});
  const json& last = runs.back();
  for (const json& cell : {last["iterations"], json(rounded(last["seconds"], 2)), json(rounded(last["error"], 2)),
                           json(rounded(last["energy"], 2))})
    cells.push_back(cell);
  return cells;
}

} // namespace

Section section34(Laboratory& laboratory)
{
  Section section{"sec-3-4", "Sec. 3.4: the solvers", {}, {}, {}, {}};
  section.paragraphs = {
      "One level of one problem, the scan of a bunny (a torus where that is not installed) with three holes, solved by "
      "each of the four solvers: from the interpolated solution of the next coarser level, as the multiscale scheme "
      "does it, and cold, from zero everywhere. Each point of a curve is a run of its own with a larger number of "
      "iterations or sweeps, in single precision; the seconds are those of all processors, set-up included.",
      "Energy is what all solvers lower, above its minimum and relative to the minimum's distance from the cold start. "
      "The error is the RMS distance of the zero level from the converged one, in voxel sides; " +
          text(accuracy) +
          " is more than enough for a surface. The converged solution is that of multigrid in double precision to a "
          "residual of 10⁻¹². An empty cell in the table: not reached within the time that a curve was given. Cholesky "
          "is left out where factorizing the wide stencil would take minutes: for k = 3, and in a quick run for k = 2.",
      "The paper solves its coarsest level by Cholesky and the others by ICM, from the interpolated solution."};
  Table table{"sec-3-4",
              "Time to " + text(accuracy) + " voxel RMS of the converged surface",
              {"prior", "start", "solver", "iterations", "CPU s", "last run: iterations", "its CPU s",
               "its error, voxels", "its relative energy above the minimum"},
              {}};
  json size;
  for (const Prior prior : allPriors) {
    Lazy<std::shared_ptr<Problem>> problem([&] { return std::make_shared<Problem>(makeProblem(prior, laboratory)); });
    const std::string key = "sec-3-4/k=" + std::to_string(order(prior)) + "/";
    size = laboratory.measure(key + "size", [&] {
      const pcl::mrf::GridSize& grid = problem()->lattice.size;
      return json::array({grid.x, grid.y, grid.z, problem()->crossings.size()});
    });
    std::vector<Entry> entries;
    for (const SolverMethod method :
         {SolverMethod::icm, SolverMethod::cg, SolverMethod::cholesky, SolverMethod::multigrid})
      for (const bool isCold : {false, true}) {
        // A factorization has no start, and takes minutes for the wider stencils.
        if (method == SolverMethod::cholesky && (!isCold || order(prior) > (laboratory.options().quick ? 1 : 2)))
          continue;
        const std::string start = isCold ? "cold" : "interpolated";
        const std::string name = std::string(nameOf(method)).append(", ").append(start);
        const json runs = laboratory.measure(std::string(key).append(name),
                                             [&] { return measureSolver(*problem(), method, isCold, laboratory); });
        if (runs.is_object()) {
          table.rows.push_back({figures::nameOf(prior), start, nameOf(method), runs.value("failed", "")});
          continue;
        }
        table.rows.push_back(row(prior, isCold, method, runs));
        entries.push_back({name, runs});
      }
    addPlots(prior, entries, section);
  }
  if (size.is_array())
    section.paragraphs.push_back("The level has " + std::to_string(size[0].get<int>()) + " × " +
                                 std::to_string(size[1].get<int>()) + " × " + std::to_string(size[2].get<int>()) +
                                 " voxels; the solver has " + std::to_string(laboratory.execution().threads()) +
                                 " threads.");
  section.tables.push_back(table);
  return section;
}

} // namespace mrf_apps

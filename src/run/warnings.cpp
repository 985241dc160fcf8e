// SPDX-License-Identifier: BSD-3-Clause
#include "run/warnings.h"

#include "base/text.h"

#include <pcl/surface/mrf/option_table.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace pcl::mrf {

namespace {

/// \param digits significant digits of the numbers
template <typename... Parts>
void warn(Report& report, int digits, const Parts&... parts)
{
  report.warnings.push_back(textOf(digits, parts...));
}

} // namespace

void warnOfNoSurface(const PointSet& points, double growth, Report& report)
{
  // Growth exponents: scans, frames and maps have medians of 1.87 to 2.23, a thin blade 2.47, volumes 2.7 and more.
  constexpr double ofVolumes = 2.6, ofCurves = 1.35, flat = 1e-5;
  const BoundingBox box = boundingBox(points.positions);
  const Eigen::Vector3d extent = (box.upper - box.lower).cast<double>();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3f& position : points.positions) {
    const Eigen::Vector3d arm = (position - (box.lower + box.upper) / 2).cast<double>();
    sum += arm;
    products += arm * arm.transpose();
  }
  const Eigen::Matrix3d covariance = products - sum * sum.transpose() / static_cast<double>(points.size());
  const Eigen::Vector3d squares =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly).eigenvalues();
  const Eigen::IOFormat product(3, Eigen::DontAlignCols, " x ");
  if (growth > ofVolumes)
    warn(report, 3,
         "the points fill a volume, of which there is no surface to follow: their number grows with the power ", growth,
         " of the distance, on surfaces 2; keep the boundary only, such as the outer voxels of a segmentation");
  else if (growth < ofCurves)
    warn(report, 3, "the points lie along lines, not on a surface: their number grows with the power ", growth,
         " of the distance, on surfaces 2; the box around them is ", extent.transpose().format(product),
         ": if x and y are degrees and z is meters, project them to meters first");
  else if (squares[0] <= flat * flat * squares[2])
    warn(report, 3, "all points lie in one plane, in a box of ", extent.transpose().format(product),
         ": if one of their coordinates is missing, give it");
}

void warnOfDroppedPoints(Report& report)
{
  constexpr double percent = 2;
  const PointCounts& counts = report.points;
  const std::pair<std::int64_t, const char*> rules[] = {
      {counts.outliersAlone, "stand alone (outliers.alone)"},
      {counts.mixedPixels, "lie between two surfaces that their sensor saw (outliers.alone)"},
      {counts.ghosts, "were seen through by other sensors, as what moves is (outliers.alone)"},
      {counts.outliersByStatistics, "are outliers by PCL's statistics (outliers.statistical)"},
      {counts.noiseByPlaneFit, "are noise by the plane fit (normals.noiseCriteria), or have no plane"},
      {counts.smallComponents,
       "are in small components, which the preset paper drops, unlike the default (orientation.minComponentShare)"},
      {counts.outliersByField, "disagree with a robust field (outliers.robust)"}};
  for (const auto& [count, what] : rules)
    if (const double dropped = 100 * static_cast<double>(count) / static_cast<double>(counts.input); dropped > percent)
      warn(report, 2, dropped, " % of the points were dropped: ", count, " of ", counts.input, ' ', what,
           "; switch the rule off if they are data");
}

void warnOfUnusedOptions(const Options& options, Report& report)
{
  const ObservationOptions& observation = options.observation;
  const Options unchanged = defaultPreset();
  const auto names = observation.atPoints()
                         ? std::vector<const char*>{"prior.beta", "prior.energy", "observation.neighbors"}
                         : std::vector<const char*>{"observation.smoothing", "observation.gradientWeight"};
  for (const char* name : names) {
    const OptionDeclaration& option = optionDeclaration(name);
    const double value = option.get(options);
    if (value != option.get(unchanged))
      report.warnings.push_back(option.name + " = " + option.textOf(value) + " has no effect on observations at " +
                                (observation.atPoints() ? "points: smoothing and noise tell how far to trust them"
                                                        : "voxels: prior.beta tells how far to trust them"));
  }
}

void warnOfConfidences(const std::vector<float>& confidences, Report& report)
{
  float largest = 1;
  std::int64_t count = 0;
  for (const float value : confidences)
    if (value > 1 && std::isfinite(value)) {
      largest = std::max(largest, value);
      ++count;
    }
  if (count > 0)
    warn(report, 6, count, " of ", confidences.size(), " confidences are above 1, up to ", largest,
         ", and count as 1; scale them to 0 to 1");
}

void warnOfCoarseInput(double resolution, double voxelSize, Report& report)
{
  if (resolution > .1 * voxelSize)
    warn(report, 3, "the coordinates are resolved to ", resolution, " only, more than a tenth of the voxel size ",
         voxelSize, "; subtract an offset from the cloud before it is stored in single precision");
}

void warnOfUnsolvedLevels(Report& report)
{
  // A refined band need not converge: the next band completes it near the points.
  const auto unsolved = std::find_if(report.levels.begin(), report.levels.end(), [&](const LevelReport& level) {
    const bool isRefined = level.unknowns < level.size.count() && &level != &report.levels.back();
    return level.observed > 0 && !level.solve.converged && !isRefined;
  });
  if (unsolved == report.levels.end())
    return;
  const SolveReport& solve = unsolved->solve;
  const std::string left = solve.method == SolverMethod::multigrid
                               ? textOf(2, "its surface would still move by about ", solve.remainingChange,
                                        " voxels at the points, ", solve.remainingChangeOfFillings, " elsewhere")
                               : textOf(2, "its relative residual is ", solve.relativeResidual);
  warn(report, 2, "the level with voxels of ", unsolved->voxelSize, " has not converged after ", solve.iterations,
       isIcm(solve.method) ? " sweeps: " : " iterations: ", left, "; allow more (solver.maxIterations)");
}

void warnOfTriangles(Report& report)
{
  const auto asked = static_cast<double>(report.options.remesher.triangles),
             made = static_cast<double>(report.mesh.triangles);
  constexpr double tolerance = .02;
  if (asked == 0 || std::abs(made - asked) <= tolerance * asked)
    return;
  report.warnings.push_back(
      "remesher.triangles = " + std::to_string(report.options.remesher.triangles) + ", but the mesh has " +
      std::to_string(report.mesh.triangles) +
      (made > asked
           ? ": no fewer keep its parts and its shape without intersections; larger voxels (multiscale.voxelSize) "
             "make a simpler surface"
           : ": remesher.rounds is too low for edges as short as that"));
}

void warnOfUncertainSurface(Report& report)
{
  warn(report, 3, 100 * report.beyondError.area / report.mesh.area,
       " % of the surface was dropped: it may be farther off than uncertainty.maxError = ",
       report.options.uncertainty.maxError);
}

} // namespace pcl::mrf

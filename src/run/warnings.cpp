// SPDX-License-Identifier: BSD-3-Clause
#include "run/warnings.h"

#include <pcl/surface/mrf/option_table.h>

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <utility>
#include <vector>

namespace pcl {
namespace mrf {

void warnOfDroppedPoints(Report& report)
{
  constexpr double share = .02;
  const PointCounts& counts = report.points;
  const std::pair<std::int64_t, const char*> rules[] = {
      {counts.outliersAlone, "stand alone (outliers.alone)"},
      {counts.outliersByStatistics, "are outliers by PCL's statistics (outliers.statistical)"},
      {counts.noiseByPlaneFit, "are noise by the plane fit (normals.noiseCriteria), or have no plane"},
      {counts.smallComponents, "are in small components, which the paper drops"},
      {counts.outliersByField, "disagree with a robust field (outliers.robust)"}};
  for (const auto& [count, what] : rules) {
    if (static_cast<double>(count) <= share * static_cast<double>(counts.input))
      continue;
    std::ostringstream text;
    text.precision(2);
    text << 100 * static_cast<double>(count) / static_cast<double>(counts.input)
         << " % of the points were dropped: " << count << " of " << counts.input << ' ' << what
         << "; switch the rule off if they are data";
    report.warnings.push_back(text.str());
  }
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

void warnOfCoarseInput(double resolution, double voxelSize, Report& report)
{
  if (resolution <= .1 * voxelSize)
    return;
  std::ostringstream text;
  text.precision(3);
  text << "the coordinates are resolved to " << resolution << " only, more than a tenth of the voxel size " << voxelSize
       << "; subtract an offset from the cloud before it is stored in single precision";
  report.warnings.push_back(text.str());
}

void warnOfUnsolvedLevels(Report& report)
{
  const auto unsolved = std::find_if(report.levels.begin(), report.levels.end(), [](const LevelReport& level) {
    return level.observed > 0 && !level.solve.converged;
  });
  if (unsolved == report.levels.end())
    return;
  const SolveReport& solve = unsolved->solve;
  std::ostringstream text;
  text.precision(2);
  text << "the level with voxels of " << unsolved->voxelSize << " has not converged after " << solve.iterations
       << (isIcm(solve.method) ? " sweeps" : " iterations");
  if (solve.method == SolverMethod::multigrid)
    text << ": its surface would still move by about " << solve.remainingChange << " voxels at the points, "
         << solve.remainingChangeOfFillings << " elsewhere";
  else
    text << ": its relative residual is " << solve.relativeResidual;
  text << "; allow more (solver.maxIterations)";
  report.warnings.push_back(text.str());
}

void warnOfUncertainSurface(Report& report)
{
  std::ostringstream text;
  text.precision(3);
  text << 100 * report.beyondError.area / report.mesh.area
       << " % of the surface was dropped: it may be farther off than uncertainty.maxError = "
       << report.options.uncertainty.maxError;
  report.warnings.push_back(text.str());
}

} // namespace mrf
} // namespace pcl

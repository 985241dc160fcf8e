// SPDX-License-Identifier: BSD-3-Clause
// The warnings of a run about its levels and points.
#include "run/warnings.h"

#include <gtest/gtest.h>

using namespace pcl::mrf;

namespace {

/// \param share of the level's voxels that were solved for
LevelReport level(double voxelSize, double share, bool isConverged)
{
  LevelReport level;
  level.size = {10, 10, 10};
  level.voxelSize = voxelSize;
  level.observed = 100;
  level.unknowns = static_cast<std::int64_t>(share * 1000);
  level.solve.converged = isConverged;
  return level;
}

std::size_t warningsOf(std::vector<LevelReport> levels)
{
  Report report;
  report.levels = std::move(levels);
  warnOfUnsolvedLevels(report);
  return report.warnings.size();
}

} // namespace

TEST(UnsolvedLevels, AreNamedUnlessAnotherBandGoesOn)
{
  EXPECT_EQ(warningsOf({level(4, 1, true), level(2, .5, true), level(1, .3, true)}), 0u);
  EXPECT_EQ(warningsOf({level(4, 1, false), level(2, .5, true), level(1, .3, true)}), 1u)
      << "fillings stay as it has them";
  EXPECT_EQ(warningsOf({level(4, 1, true), level(2, .5, false), level(1, .3, true)}), 0u);
  EXPECT_EQ(warningsOf({level(4, 1, true), level(2, .5, true), level(1, .3, false)}), 1u);
  EXPECT_EQ(warningsOf({level(4, 1, true), level(2, 1, false)}), 1u);
}

TEST(DroppedPoints, AreSaidToBeByWhichOption)
{
  Report report;
  report.points.input = 1000;
  report.points.outliersAlone = report.points.outliersByStatistics = report.points.noiseByPlaneFit =
      report.points.smallComponents = report.points.outliersByField = 52;
  warnOfDroppedPoints(report);
  ASSERT_EQ(report.warnings.size(), 5u);
  for (const std::string& warning : report.warnings)
    EXPECT_NE(warning.find('.', 4), std::string::npos) << "no option is named: " << warning;
}

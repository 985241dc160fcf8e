// SPDX-License-Identifier: BSD-3-Clause
#include "run/run_plan.h"

#include "run/option_resolver.h"

namespace pcl::mrf {

std::vector<ExpectedStage> expectedStages(std::size_t points, const Options& options)
{
  const double millions = 1e-6 * static_cast<double>(points);
  const bool estimatesNormals = options.normals.source != NormalSource::use;
  // Iterations that pass on one voxel's width each take that much longer than multigrid.
  const double solving = options.solver.method == SolverMethod::multigrid ? 1 : 20;
  return {{"gathering", .1 * millions},
          {"outliers", .6 * millions},
          {"sampling density", .05 * millions},
          {"normals", estimatesNormals ? .5 * millions : 0},
          {"orientation", .5 * millions},
          {"robust field", options.outliers.robust ? .2 + 5 * millions : 0},
          {"noise", mayAskForNoise(options) ? .15 : 0},
          {"smoothing length", choosesSmoothing(options) ? .5 : 0},
          {"resolution", choosesResolution(options) ? .3 : 0},
          {"volume", options.multiscale.padding == 0 ? .05 : 0},
          {"regularization", solving * (.2 + 14 * millions)},
          {"polygonizer", millions},
          {"trimming", 6 * millions},
          {"remesher", 2.2 * options.remesher.rounds * millions},
          {"uncertainty", wantsUncertainty(options) ? .8 + 2 * millions : 0},
          {"attributes", .2 * millions}};
}

} // namespace pcl::mrf

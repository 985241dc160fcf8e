// SPDX-License-Identifier: BSD-3-Clause
#include "support/linear_systems.h"

#include <gtest/gtest.h>

using namespace pcl::mrf;
using namespace systems;

TEST(Solver, sameBytesForAnyNumberOfThreads)
{
  const GridSize size{53, 47, 44}; // above the size that is cut into slabs
  for (const Energy energyKind : allEnergies)
    for (const Prior prior : allPriors) {
      Execution single;
      const auto system = assemble(observeSphere(size), priorOptions(prior, energyKind), single);
      for (const SolverMethod method : {SolverMethod::cg, SolverMethod::icmColors, SolverMethod::icm}) {
        const SolverOptions options = solverOptions(method, 1e-9, isIcm(method) ? 1 : 2);
        std::vector<double> first;
        std::vector<double> firstHistory;
        for (const int threads : {1, 3, 11}) { // 11: slabs thinner than the smoother's reach
          Execution execution(threads);
          auto d = zeros(system);
          const SolveReport report = solve(system, options, 1, d, execution);
          if (first.empty()) {
            first = d;
            firstHistory = report.history;
          }
          EXPECT_EQ(d, first) << "method " << static_cast<int>(method) << ", " << threads << " threads";
          EXPECT_EQ(report.history, firstHistory);
        }
      }
    }
}

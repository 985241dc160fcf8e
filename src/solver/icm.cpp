// SPDX-License-Identifier: BSD-3-Clause
#include "solver/linear_system.h"

#include "field/prior.h"
#include "solver/grid_operator.h"

#include <pcl/surface/mrf/report.h>

#include <array>
#include <cmath>
#include <numeric>
#include <random>

namespace pcl::mrf {
namespace {

/// Voxels between two chances to cancel.
constexpr std::size_t polled = 1 << 16;

/// Color (x + b y + c z) mod count: voxels of one color are more than `order` steps of the lattice apart, so no power
/// of L up to that order couples them. The counts are the smallest there are for colorings of this form.
struct Coloring {
  int count, b, c;

  explicit Coloring(int radius)
  {
    constexpr std::array<std::array<int, 3>, 3> table = {{{2, 1, 1}, {7, 2, 3}, {12, 3, 5}}};
    const auto& row = table[radius - 1];
    count = row[0];
    b = row[1];
    c = row[2];
  }

  /// The first x of a color in the row (y, z).
  int first(int color, int y, int z) const
  {
    const auto shift = (std::int64_t{b} * y + std::int64_t{c} * z) % count;
    return static_cast<int>((color + count - shift) % count);
  }
};

/// Sum of body(index) over the voxels of a color; the same for any number of threads.
template <typename Body>
double sumOverColor(const GridSize& size, const Coloring& coloring, int color, Execution& execution, const Body& body)
{
  const std::int64_t grain = size.count() < serialVoxels ? size.z : 4;
  return execution.sum(size.z, grain, [&](int begin, int end) {
    double sum = 0;
    for (int z = begin; z < end; ++z)
      for (int y = 0; y < size.y; ++y)
        for (int x = coloring.first(color, y, z); x < size.x; x += coloring.count)
          sum += body(size.index(x, y, z));
    return sum;
  });
}

/// Minimizes the energy over a voxel given the others. \return its squared change
double settle(const LinearSystem& system, std::int64_t voxel, double diagonal, std::vector<double>& d)
{
  if (!(diagonal > 0))
    return 0;
  const double change = (system.rightHandSide[voxel] - rowTimes(system.matrix, voxel, d)) / diagonal;
  d[voxel] += change;
  return change * change;
}

/// Fisher–Yates of our own: the standard library's shuffle differs between its implementations.
void shuffle(std::vector<std::int64_t>& order, std::mt19937_64& random)
{
  for (std::size_t n = order.size(); n > 1; --n)
    std::swap(order[n - 1], order[random() % n]);
}

} // namespace

SolveReport solveIcm(const LinearSystem& system, const SolverOptions& options, double unit, std::vector<double>& d,
                     Execution& execution)
{
  const GridSize size = system.size;
  const int maxSweeps = options.maxIterations > 0 ? options.maxIterations : 1000;
  const Eigen::VectorXd diagonal = system.matrix.diagonal();
  const auto settleVoxel = [&](std::int64_t voxel) { return settle(system, voxel, diagonal[voxel], d); };
  // Data that couple a voxel with its 26 neighbors reach as far as L³.
  const Coloring coloring(system.coupling.corners ? 3 : system.coupling.steps);
  const bool isParallel = options.method == SolverMethod::icmColors;

  SolveReport report;
  report.method = options.method;
  std::mt19937_64 random(options.seed);
  std::vector<std::int64_t> turns(isParallel ? coloring.count : size.count());
  std::iota(turns.begin(), turns.end(), 0);
  while (report.iterations < maxSweeps && !report.converged) {
    shuffle(turns, random);
    double squaredChange = 0;
    for (std::size_t turn = 0; turn < turns.size(); ++turn) {
      if (isParallel)
        squaredChange += sumOverColor(size, coloring, static_cast<int>(turns[turn]), execution, settleVoxel);
      else
        squaredChange += settleVoxel(turns[turn]);
      if (isParallel || turn % polled == 0)
        execution.poll();
    }
    ++report.iterations;
    report.history.push_back(energy(system, d, execution));
    const double change = std::sqrt(squaredChange / static_cast<double>(size.count())) / unit;
    report.converged = change < options.changeTolerance;
    execution.progress(static_cast<double>(report.iterations) / maxSweeps);
  }
  report.relativeResidual = relativeResidual(system, d, execution);
  return report;
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "solver/icm.h"

#include "field/prior.h"
#include "solver/grid_operator.h"

#include <pcl/surface/mrf/report.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>

namespace pcl {
namespace mrf {
namespace {

/// Color (x + b y + c z) mod count: voxels of one color are more than `order` steps of the lattice apart, so no power
/// of L up to that order couples them. The counts are the smallest there are for colorings of this form.
struct Coloring {
  int count, b, c;

  explicit Coloring(int radius)
  {
    constexpr std::array<std::array<int, 3>, 3> table = {{{2, 1, 1}, {7, 2, 3}, {12, 3, 5}}};
    const auto& row = table[static_cast<std::size_t>(radius - 1)];
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
  return execution.sum(size.z, grain, [&](std::int64_t begin, std::int64_t end) {
    double sum = 0;
    for (int z = static_cast<int>(begin); z < end; ++z)
      for (int y = 0; y < size.y; ++y) {
        const std::int64_t row = size.index(0, y, z);
        for (int x = coloring.first(color, y, z); x < size.x; x += coloring.count)
          sum += body(static_cast<std::size_t>(row + x));
      }
    return sum;
  });
}

/// The diagonal of P + C. Voxels of one color do not interact: what the system makes of ones on all of them is the
/// diagonal there.
std::vector<double> diagonalOf(const LinearSystem& system, const Coloring& coloring, SystemProduct& times,
                               std::vector<double>& product, Execution& execution)
{
  std::vector<double> diagonal(product.size()), ones(product.size(), 0);
  for (int color = 0; color < coloring.count; ++color) {
    const auto setOnes = [&](double value) {
      sumOverColor(system.size(), coloring, color, execution, [&](std::size_t i) {
        ones[i] = value;
        return 0;
      });
    };
    setOnes(1);
    times.apply(ones, product, execution);
    setOnes(0);
    sumOverColor(system.size(), coloring, color, execution, [&](std::size_t i) {
      diagonal[i] = product[i];
      return 0;
    });
    execution.poll();
  }
  return diagonal;
}

/// Fisher–Yates of our own: the standard library's shuffle differs between its implementations.
void shuffle(std::vector<int>& order, std::mt19937_64& random)
{
  for (std::size_t n = order.size(); n > 1; --n)
    std::swap(order[n - 1], order[random() % n]);
}

} // namespace

SolveReport solveIcm(const LinearSystem& system, const SolverOptions& options, double unit, std::vector<double>& d,
                     Execution& execution)
{
  const GridSize size = system.size();
  const std::vector<double>& b = system.rightHandSide;
  const int maxSweeps = options.maxIterations > 0 ? options.maxIterations : 1000;
  // Data that couple a voxel with its 26 neighbors reach as far as L³.
  const Coloring coloring(system.isDiagonal() ? order(system.prior.kind) : 3);
  SystemProduct times(system);
  std::vector<double> product(d.size());
  const std::vector<double> diagonal = diagonalOf(system, coloring, times, product, execution);

  SolveReport report;
  report.method = SolverMethod::icm;
  std::mt19937_64 random(options.seed);
  std::vector<int> colors(static_cast<std::size_t>(coloring.count));
  std::iota(colors.begin(), colors.end(), 0);
  while (report.iterations < maxSweeps && !report.converged) {
    shuffle(colors, random);
    double squaredChange = 0;
    for (const int color : colors) {
      // Whole products cost less than the rows of one color do: they run along memory, and share powers of L.
      times.apply(d, product, execution);
      squaredChange += sumOverColor(size, coloring, color, execution, [&](std::size_t i) {
        if (!(diagonal[i] > 0))
          return 0.;
        const double change = (b[i] - product[i]) / diagonal[i];
        d[i] += change;
        return change * change;
      });
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

} // namespace mrf
} // namespace pcl

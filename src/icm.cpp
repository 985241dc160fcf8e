#include "icm.h"

#include "linear_system.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <random>

namespace pcl {
namespace mrf {
namespace {

/// Colour (x + b y + c z) mod count: voxels of one colour are more than `order` steps of the lattice apart, so no power
/// of L up to that order couples them. The counts are the smallest there are for colourings of this form.
struct Colouring {
  int count, b, c;

  explicit Colouring(int radius)
  {
    constexpr std::array<std::array<int, 3>, 3> table = {{{2, 1, 1}, {7, 2, 3}, {12, 3, 5}}};
    const auto& row = table[static_cast<std::size_t>(radius - 1)];
    count = row[0];
    b = row[1];
    c = row[2];
  }

  /// The first x of a colour in the row (y, z).
  int first(int colour, int y, int z) const
  {
    const auto shift = (std::int64_t{b} * y + std::int64_t{c} * z) % count;
    return static_cast<int>((colour + count - shift) % count);
  }
};

/// Index of the voxel that stands for one outside the grid: dropping missing neighbours is the same as mirroring the
/// field at the border faces.
int mirrored(int i, int n)
{
  const int period = 2 * n;
  i = ((i % period) + period) % period;
  return i < n ? i : period - 1 - i;
}

/// The rows of L^k + C for a diagonal C.
template <typename Real>
class StencilRows {
public:
  explicit StencilRows(const LinearSystem<Real>& system)
      : size_(system.size()), order_(order(system.prior.prior)), data_(system.data->diagonal())
  {
    const int side = 2 * order_ + 1;
    const auto at = [side](int x, int y, int z) { return static_cast<std::size_t>(x + side * (y + side * z)); };
    std::vector<double> stencil(at(0, 0, side)), next(stencil.size());
    stencil[at(order_, order_, order_)] = 1;
    const auto value = [&](int x, int y, int z) {
      const bool inside = x >= 0 && y >= 0 && z >= 0 && x < side && y < side && z < side;
      return inside ? stencil[at(x, y, z)] : 0.0;
    };
    for (int power = 0; power < order_; ++power) {
      for (int z = 0; z < side; ++z)
        for (int y = 0; y < side; ++y)
          for (int x = 0; x < side; ++x)
            next[at(x, y, z)] = 6 * value(x, y, z) - value(x - 1, y, z) - value(x + 1, y, z) - value(x, y - 1, z) -
                                value(x, y + 1, z) - value(x, y, z - 1) - value(x, y, z + 1);
      stencil.swap(next);
    }
    for (int z = 0; z < side; ++z)
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x)
          if (const double coefficient = value(x, y, z)) {
            const int dx = x - order_, dy = y - order_, dz = z - order_;
            entries_.push_back({dx, dy, dz, dx + size_.x * (dy + std::int64_t{size_.y} * dz), coefficient});
          }
  }

  /// Row times d, and the row's diagonal entry.
  std::pair<double, double> evaluate(int x, int y, int z, const Real* d) const
  {
    const std::int64_t i = size_.index(x, y, z);
    const double weight = static_cast<double>(data_[static_cast<std::size_t>(i)]);
    double product = weight * static_cast<double>(d[i]), diagonal = weight;
    if (inside(x, size_.x) && inside(y, size_.y) && inside(z, size_.z)) {
      for (const Entry& entry : entries_)
        product += entry.coefficient * static_cast<double>(d[i + entry.offset]);
      diagonal += entries_[entries_.size() / 2].coefficient;
      return {product, diagonal};
    }
    for (const Entry& entry : entries_) {
      const std::int64_t j =
          size_.index(mirrored(x + entry.x, size_.x), mirrored(y + entry.y, size_.y), mirrored(z + entry.z, size_.z));
      product += entry.coefficient * static_cast<double>(d[j]);
      if (j == i)
        diagonal += entry.coefficient;
    }
    return {product, diagonal};
  }

private:
  struct Entry {
    int x, y, z;
    std::int64_t offset;
    double coefficient;
  };

  bool inside(int i, int n) const { return i >= order_ && i + order_ < n; }

  GridSize size_;
  int order_;
  const std::vector<Real>& data_;
  std::vector<Entry> entries_;
};

/// The rows of the explicit matrix, for voxel weights and for data that couple voxels.
template <typename Real>
class MatrixRows {
public:
  explicit MatrixRows(const LinearSystem<Real>& system) : size_(system.size()), matrix_(systemMatrix(system)) {}

  std::pair<double, double> evaluate(int x, int y, int z, const Real* d) const
  {
    const std::int64_t i = size_.index(x, y, z);
    double product = 0, diagonal = 0;
    for (Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t>::InnerIterator entry(matrix_, i); entry; ++entry) {
      product += entry.value() * static_cast<double>(d[entry.row()]); // symmetric: the column is the row
      if (entry.row() == i)
        diagonal = entry.value();
    }
    return {product, diagonal};
  }

private:
  GridSize size_;
  Eigen::SparseMatrix<double, Eigen::ColMajor, std::int64_t> matrix_;
};

/// Fisher–Yates of our own: the standard library's shuffle differs between its implementations.
void shuffle(std::vector<int>& order, std::mt19937_64& random)
{
  for (std::size_t n = order.size(); n > 1; --n)
    std::swap(order[n - 1], order[random() % n]);
}

template <typename Real, typename Rows>
SolveReport sweep(const LinearSystem<Real>& system, const Rows& rows, const Colouring& colouring,
                  const SolverOptions& options, double unit, std::vector<Real>& d, Execution& execution)
{
  const GridSize size = system.size();
  const std::vector<Real>& b = system.data->rightHandSide();
  const int maxSweeps = options.maxIterations > 0 ? options.maxIterations : 1000;
  const std::int64_t grain = size.count() < serialVoxels ? size.z : 4;

  SolveReport report;
  report.method = SolverMethod::icm;
  std::mt19937_64 random(options.seed);
  std::vector<int> colours(static_cast<std::size_t>(colouring.count));
  std::iota(colours.begin(), colours.end(), 0);
  while (report.iterations < maxSweeps && !report.converged) {
    shuffle(colours, random);
    double squaredChange = 0;
    for (const int colour : colours)
      squaredChange += execution.sum(size.z, grain, [&](std::int64_t begin, std::int64_t end) {
        double sum = 0;
        for (int z = static_cast<int>(begin); z < end; ++z)
          for (int y = 0; y < size.y; ++y)
            for (int x = colouring.first(colour, y, z); x < size.x; x += colouring.count) {
              const auto i = static_cast<std::size_t>(size.index(x, y, z));
              const auto [product, diagonal] = rows.evaluate(x, y, z, d.data());
              if (diagonal > 0) {
                const double change = (static_cast<double>(b[i]) - product) / diagonal;
                d[i] = static_cast<Real>(static_cast<double>(d[i]) + change);
                sum += change * change;
              }
            }
        return sum;
      });
    ++report.iterations;
    report.history.push_back(energy(system, d, execution));
    const double change = std::sqrt(squaredChange / static_cast<double>(size.count())) / unit;
    report.converged = change < options.changeTolerance;
    execution.progress(static_cast<double>(report.iterations) / maxSweeps);
  }
  if (options.changeTolerance == 0)
    report.converged = true; // all that was asked for are the sweeps
  report.relativeResidual = relativeResidual(system, d, execution);
  return report;
}

} // namespace

template <typename Real>
SolveReport solveIcm(const LinearSystem<Real>& system, const SolverOptions& options, double unit, std::vector<Real>& d,
                     Execution& execution)
{
  if (system.prior.voxelWeights.empty() && system.data->isDiagonal())
    return sweep(system, StencilRows<Real>(system), Colouring(order(system.prior.prior)), options, unit, d, execution);
  // Data that couple a voxel with its 26 neighbours reach as far as L³.
  const int radius = system.data->isDiagonal() ? order(system.prior.prior) : 3;
  return sweep(system, MatrixRows<Real>(system), Colouring(radius), options, unit, d, execution);
}

template SolveReport solveIcm(const LinearSystem<float>&, const SolverOptions&, double, std::vector<float>&,
                              Execution&);
template SolveReport solveIcm(const LinearSystem<double>&, const SolverOptions&, double, std::vector<double>&,
                              Execution&);

} // namespace mrf
} // namespace pcl

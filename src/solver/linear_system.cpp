// SPDX-License-Identifier: BSD-3-Clause
#include "solver/linear_system.h"

#include "base/vector_kernels.h"
#include "field/prior.h"
#include "options/validation.h"

#include <pcl/surface/mrf/exceptions.h>

#include <pcl/surface/mrf/options.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace pcl::mrf {
namespace {

/// Rows of a matrix per piece of work.
constexpr std::int64_t rowGrain = 1 << 14;

/// What a row holds of the voxels that are at most three steps away along each axis.
class Row {
public:
  /// \param center voxel that the row belongs to
  void reset(const Eigen::Array3i& center)
  {
    center_ = center;
    values_.fill(0);
  }
  const Eigen::Array3i& center() const { return center_; }

  void add(const Eigen::Array3i& voxel, double value) { values_[at(voxel - center_)] += value; }

  /// Adds another voxel's row.
  void add(const Row& other)
  {
    for (std::size_t i = 0; i < values_.size(); ++i)
      values_[i] += other.values_[i];
  }

  /// Calls visit(step, value) for all that is not zero, in the order of the voxels.
  template <typename Visit>
  void forEach(const Visit& visit) const
  {
    std::size_t i = 0;
    for (int z = -reach; z <= reach; ++z)
      for (int y = -reach; y <= reach; ++y)
        for (int x = -reach; x <= reach; ++x, ++i)
          if (values_[i] != 0)
            visit(Eigen::Array3i(x, y, z), values_[i]);
  }

private:
  static constexpr int reach = 3, side = 2 * reach + 1;

  static std::size_t at(const Eigen::Array3i& step)
  {
    return static_cast<std::size_t>((step.x() + reach) + side * ((step.y() + reach) + side * (step.z() + reach)));
  }

  Eigen::Array3i center_ = Eigen::Array3i::Zero();
  std::array<double, side * side * side> values_;
};

/// The neighbors of the voxels of a grid.
class Neighborhood {
public:
  explicit Neighborhood(const GridSize& size) : size_(size) {}

  const GridSize& size() const { return size_; }

  template <typename Visit>
  void forEach(const Eigen::Array3i& voxel, const Visit& visit) const
  {
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        Eigen::Array3i neighbor = voxel;
        neighbor[axis] += step;
        if (size_.contains(neighbor.x(), neighbor.y(), neighbor.z()))
          visit(neighbor);
      }
  }

  int count(const Eigen::Array3i& voxel) const
  {
    int count = 0;
    forEach(voxel, [&](const Eigen::Array3i&) { ++count; });
    return count;
  }

private:
  GridSize size_;
};

/// The rows of L^k.
class PowerRows {
public:
  PowerRows(const GridSize& size, int power) : neighbors_(size), power_(power)
  {
    // Inside of a grid all rows are the same.
    const int side = 2 * power + 1;
    inner_.reset(Eigen::Array3i::Constant(power));
    addPower(Neighborhood({side, side, side}), power, inner_.center(), 1, inner_);
  }

  void add(Row& row) const
  {
    const Eigen::Array3i& at = row.center();
    const GridSize& size = neighbors_.size();
    if ((at >= power_).all() && (at + power_ < Eigen::Array3i(size.x, size.y, size.z)).all())
      row.add(inner_);
    else
      addPower(neighbors_, power_, at, 1, row);
  }

private:
  static void addPower(const Neighborhood& neighbors, int power, const Eigen::Array3i& at, double factor, Row& row)
  {
    if (power == 0) {
      row.add(at, factor);
      return;
    }
    addPower(neighbors, power - 1, at, factor * neighbors.count(at), row);
    neighbors.forEach(at, [&](const Eigen::Array3i& other) { addPower(neighbors, power - 1, other, -factor, row); });
  }

  Neighborhood neighbors_;
  int power_;
  Row inner_;
};

/// The rows of the prior of Energy::paper: half the derivative of Σ v_i U(d_i).
class PaperRows {
public:
  /// \param shares v
  PaperRows(const GridSize& size, Prior prior, const std::vector<double>& shares)
      : neighbors_(size), isOfDifferences_(prior == Prior::membrane), shares_(shares)
  {}

  void add(Row& row) const
  {
    const Eigen::Array3i& at = row.center();
    if (isOfDifferences_) { // U_i = Σ (d_i − d_j)² / n_i
      neighbors_.forEach(at, [&](const Eigen::Array3i& other) {
        const double weight = share(at) / neighbors_.count(at) + share(other) / neighbors_.count(other);
        row.add(at, weight);
        row.add(other, -weight);
      });
      return;
    }
    // U_i = Σ (l_i − l_j)², l = M d: Mᵀ K M, K of edges that weigh v_i + v_j.
    addDifferences(at, 1, row);
    neighbors_.forEach(at,
                       [&](const Eigen::Array3i& other) { addDifferences(other, -1. / neighbors_.count(other), row); });
  }

private:
  double share(const Eigen::Array3i& voxel) const
  {
    return shares_[neighbors_.size().index(voxel.x(), voxel.y(), voxel.z())];
  }

  /// A row of K M.
  void addDifferences(const Eigen::Array3i& at, double factor, Row& row) const
  {
    neighbors_.forEach(at, [&](const Eigen::Array3i& other) {
      const double weight = factor * (share(at) + share(other));
      addOffMean(at, weight, row);
      addOffMean(other, -weight, row);
    });
  }

  /// A row of M: l_i, the voxel less the mean of its neighbors.
  void addOffMean(const Eigen::Array3i& at, double factor, Row& row) const
  {
    const int count = neighbors_.count(at);
    if (count == 0)
      return;
    row.add(at, factor);
    neighbors_.forEach(at, [&](const Eigen::Array3i& other) { row.add(other, -factor / count); });
  }

  Neighborhood neighbors_;
  bool isOfDifferences_;
  const std::vector<double>& shares_;
};

/// \param addRow adds what a row holds \throw ResourceLimit if the entries cannot be counted
template <typename AddRow>
SystemMatrix matrixOf(const GridSize& size, const AddRow& addRow, Execution& execution)
{
  SystemMatrix matrix(size.count(), size.count());
  int* const begins = matrix.outerIndexPtr();
  const auto forRows = [&](const auto& body) {
    execution.forRange(size.count(), rowGrain, [&](std::int64_t begin, std::int64_t end) {
      Row row;
      for (std::int64_t voxel = begin; voxel < end; ++voxel) {
        row.reset(size.voxel(voxel));
        addRow(voxel, row);
        body(voxel, row);
      }
    });
    execution.poll();
  };
  forRows([&](std::int64_t voxel, const Row& row) {
    int entries = 0;
    row.forEach([&](const Eigen::Array3i&, double) { ++entries; });
    begins[voxel + 1] = entries;
  });
  begins[0] = 0;
  for (std::int64_t voxel = 0; voxel < size.count(); ++voxel) {
    if (begins[voxel] > std::numeric_limits<int>::max() - begins[voxel + 1])
      throw ResourceLimit("the plain matrix of " + std::to_string(size.count()) +
                          " unknowns has more entries than can be counted; use the solver multigrid or larger voxels");
    begins[voxel + 1] += begins[voxel];
  }
  matrix.resizeNonZeros(begins[size.count()]);
  forRows([&](std::int64_t voxel, const Row& row) {
    int at = begins[voxel];
    row.forEach([&](const Eigen::Array3i& step, double value) {
      matrix.innerIndexPtr()[at] = static_cast<int>(voxel + size.index(step.x(), step.y(), step.z()));
      matrix.valuePtr()[at++] = value;
    });
  });
  return matrix;
}

int neighborIndex(int dx, int dy, int dz)
{
  return (dx + 1) + 3 * ((dy + 1) + 3 * (dz + 1));
}

/// The cell of a sample along one axis: voxels lower and lower + 1, with the share of the upper one. An axis of one
/// voxel has no cell; its only voxel takes the whole weight.
struct AxisCell {
  int lower = 0;
  double upperShare = 0;
  bool isFlat = false;

  AxisCell() = default;
  AxisCell(float coordinate, int size) : isFlat(size == 1)
  {
    if (isFlat)
      return;
    lower = std::clamp(floorOf(coordinate), 0, size - 2);
    upperShare = static_cast<double>(coordinate) - lower;
  }

  double share(int upper) const { return upper ? upperShare : 1 - upperShare; }
  double slope(int upper) const { return isFlat ? 0 : upper ? 1 : -1; }
};

struct Cell {
  AxisCell x, y, z;

  Cell(const Eigen::Vector3f& position, const GridSize& size)
      : x(position.x(), size.x), y(position.y(), size.y), z(position.z(), size.z)
  {}

  double value(int corner) const { return x.share(corner & 1) * y.share(corner >> 1 & 1) * z.share(corner >> 2); }

  Eigen::Vector3d gradient(int corner) const
  {
    const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2;
    return {x.slope(a) * y.share(b) * z.share(c), x.share(a) * y.slope(b) * z.share(c),
            x.share(a) * y.share(b) * z.slope(c)};
  }

  bool has(int corner) const
  {
    return !(x.isFlat && (corner & 1)) && !(y.isFlat && (corner >> 1 & 1)) && !(z.isFlat && (corner >> 2));
  }

  std::int64_t voxel(int corner, const GridSize& size) const
  {
    return size.index(x.lower + (corner & 1), y.lower + (corner >> 1 & 1), z.lower + (corner >> 2));
  }
};

/// The row of C that belongs to one voxel, by neighborIndex.
using DataRow = std::array<double, 27>;

/// Adds what a sample says of the rows of its cell's voxels. \param rowOf gives the row of a voxel
template <typename RowOf>
void addSample(const GridSize& size, const PointSample& sample, const PointWeights& weights, double unit,
               const RowOf& rowOf, std::vector<double>& b)
{
  const Cell cell(sample.position, size);
  for (int corner = 0; corner < 8; ++corner) {
    if (!cell.has(corner))
      continue;
    const std::int64_t voxel = cell.voxel(corner, size);
    const double value = weights.value * sample.weight * cell.value(corner);
    const Eigen::Vector3d gradient = weights.gradient * sample.weight * cell.gradient(corner);
    DataRow& row = rowOf(voxel);
    for (int other = 0; other < 8; ++other)
      if (cell.has(other)) {
        const auto step = [&](int axis) { return (other >> axis & 1) - (corner >> axis & 1); };
        row[neighborIndex(step(0), step(1), step(2))] += value * cell.value(other) + gradient.dot(cell.gradient(other));
      }
    b[voxel] += unit * gradient.dot(sample.normal.cast<double>());
  }
}

} // namespace

double dataWeight(double confidence, double beta)
{
  const double a = std::clamp(confidence * beta, 0.0, 1 - 1e-6);
  return a / (1 - a);
}

double entriesPerVoxel(Prior prior, bool pointwise)
{
  // All voxels within k steps, for points with the corners of the cells around.
  constexpr std::array<double, 3> ofPrior{7, 25, 63}, withCells{27, 33, 63};
  return (pointwise ? withCells : ofPrior)[order(prior) - 1];
}

LinearSystem assemble(const Observation& observation, const PriorOptions& options, Execution& execution)
{
  validate(options);
  const GridSize size = observation.lattice.size;
  const auto count = static_cast<std::size_t>(size.count());
  if (observation.distances.size() != observation.voxels.size() ||
      observation.confidences.size() != observation.voxels.size())
    throw std::invalid_argument("assemble: the observation's arrays differ in length");

  const bool isPaper = options.energy == Energy::paper;
  LinearSystem system;
  system.size = size;
  system.coupling.steps = isPaper && options.kind != Prior::membrane ? 3 : order(options.kind);
  system.rightHandSide.assign(count, 0);
  std::vector<double> weights(count, 0), shares(isPaper ? count : 0, 1);
  for (std::size_t n = 0; n < observation.voxels.size(); ++n) {
    const auto voxel = static_cast<std::size_t>(observation.voxels[n]);
    if (voxel >= count)
      throw std::invalid_argument("assemble: an observed voxel is outside the lattice");
    const double w = dataWeight(static_cast<double>(observation.confidences[n]), static_cast<double>(options.beta));
    const double a = w / (1 + w);
    weights[voxel] = isPaper ? a : centerCoefficient(options.kind) * w;
    system.rightHandSide[voxel] = weights[voxel] * static_cast<double>(observation.distances[n]);
    system.isObserved = system.isObserved || w > 0;
    if (isPaper)
      shares[voxel] = 1 - a;
  }
  const auto build = [&](const auto& prior) {
    system.matrix = matrixOf(
        size,
        [&](std::int64_t voxel, Row& row) {
          prior.add(row);
          row.add(row.center(), weights[voxel]);
        },
        execution);
  };
  if (isPaper)
    build(PaperRows(size, options.kind, shares));
  else
    build(PowerRows(size, order(options.kind)));
  return system;
}

LinearSystem assembleAtPoints(const GridSize& size, Prior prior, const std::vector<PointSample>& samples,
                              const PointWeights& weights, double unit, Execution& execution)
{
  LinearSystem system;
  system.size = size;
  system.coupling = {order(prior), true};
  system.isObserved = !samples.empty();
  system.rightHandSide.assign(size.count(), 0);
  constexpr std::int32_t none = -1;
  std::vector<std::int32_t> rowOf(static_cast<std::size_t>(size.count()), none);
  std::vector<DataRow> rows;
  const auto rowAt = [&](std::int64_t voxel) -> DataRow& {
    std::int32_t& index = rowOf[voxel];
    if (index == none) {
      index = static_cast<std::int32_t>(rows.size());
      rows.push_back({});
    }
    return rows[index];
  };
  constexpr std::size_t polled = 1 << 16;
  for (std::size_t s = 0; s < samples.size(); ++s) {
    addSample(size, samples[s], weights, unit, rowAt, system.rightHandSide);
    if (s % polled == 0)
      execution.poll();
  }
  const PowerRows powers(size, order(prior));
  system.matrix = matrixOf(
      size,
      [&](std::int64_t voxel, Row& row) {
        powers.add(row);
        const std::int32_t index = rowOf[voxel];
        if (index == none)
          return;
        const DataRow& data = rows[index];
        for (int z = -1; z <= 1; ++z)
          for (int y = -1; y <= 1; ++y)
            for (int x = -1; x <= 1; ++x)
              row.add(row.center() + Eigen::Array3i(x, y, z), data[neighborIndex(x, y, z)]);
      },
      execution);
  return system;
}

void multiply(const LinearSystem& system, const std::vector<double>& x, std::vector<double>& y, Execution& execution)
{
  execution.forRange(system.size.count(), rowGrain, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i)
      y[i] = rowTimes(system.matrix, i, x);
  });
}

double residual(const LinearSystem& system, const std::vector<double>& x, std::vector<double>& r, Execution& execution)
{
  multiply(system, x, r, execution);
  scaleAndAdd(-1, system.rightHandSide, r, execution);
  return dotProduct(r, r, execution);
}

double energy(const LinearSystem& system, const std::vector<double>& d, Execution& execution)
{
  std::vector<double> product(d.size());
  multiply(system, d, product, execution);
  const double quadratic = dotProduct(d, product, execution), linear = dotProduct(system.rightHandSide, d, execution);
  return (.5 * quadratic - linear) / static_cast<double>(d.size());
}

double relativeResidual(const LinearSystem& system, const std::vector<double>& d, Execution& execution)
{
  std::vector<double> r(d.size());
  const double squared = residual(system, d, r, execution);
  const double norm = std::sqrt(dotProduct(system.rightHandSide, system.rightHandSide, execution));
  return norm > 0 ? std::sqrt(squared) / norm : std::sqrt(squared);
}

} // namespace pcl::mrf

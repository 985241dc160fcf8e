// SPDX-License-Identifier: BSD-3-Clause
#include "solver/linear_system.h"

#include "base/loops.h"
#include "base/vector_kernels.h"
#include "field/prior.h"
#include "options/validation.h"

#include <pcl/surface/mrf/exceptions.h>

#include <pcl/surface/mrf/options.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace pcl::mrf {
namespace {

/// Rows of a matrix per piece of work.
constexpr std::int64_t rowGrain = 1 << 14;

/// A row of a matrix: the entries of all voxels that are at most three steps away along each axis.
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

  /// Adds another voxel's row, shifted to this center.
  void add(const Row& other)
  {
    for (std::size_t i = 0; i < values_.size(); ++i)
      values_[i] += other.values_[i];
  }

  /// Calls visit(step, value) for all entries that are not zero, in the order of the voxels.
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

  static int at(const Eigen::Array3i& step)
  {
    return (step.x() + reach) + side * ((step.y() + reach) + side * (step.z() + reach));
  }

  Eigen::Array3i center_ = Eigen::Array3i::Zero();
  std::array<double, side * side * side> values_;
};

/// The graph of a grid's voxels, each joined to its neighbors along the axes.
class Graph {
public:
  explicit Graph(const GridSize& size) : size_(size) {}

  template <typename Visit>
  void forNeighbors(const Eigen::Array3i& voxel, const Visit& visit) const
  {
    for (int axis = 0; axis < 3; ++axis)
      for (const int step : {-1, 1}) {
        Eigen::Array3i neighbor = voxel;
        neighbor[axis] += step;
        if (size_.contains(neighbor.x(), neighbor.y(), neighbor.z()))
          visit(neighbor);
      }
  }

  int degree(const Eigen::Array3i& voxel) const
  {
    int count = 0;
    forNeighbors(voxel, [&](const Eigen::Array3i&) { ++count; });
    return count;
  }

  /// Calls visit(voxel, factor × entry) for a row of the Laplacian whose edges weigh weightOf(voxel, neighbor).
  template <typename WeightOf, typename Visit>
  void forLaplacian(const Eigen::Array3i& voxel, double factor, const WeightOf& weightOf, const Visit& visit) const
  {
    double sum = 0;
    forNeighbors(voxel, [&](const Eigen::Array3i& neighbor) {
      const double weight = weightOf(voxel, neighbor);
      sum += weight;
      visit(neighbor, -factor * weight);
    });
    visit(voxel, factor * sum);
  }

  /// Adds factor × the voxel's row of L^power to `row`.
  void addPower(const Eigen::Array3i& voxel, int power, double factor, Row& row) const
  {
    if (power == 0)
      row.add(voxel, factor);
    else
      forLaplacian(voxel, factor, weighsOne,
                   [&](const Eigen::Array3i& other, double entry) { addPower(other, power - 1, entry, row); });
  }

  static double weighsOne(const Eigen::Array3i&, const Eigen::Array3i&) { return 1; }

private:
  GridSize size_;
};

/// A function that adds the row of L^power to a Row.
auto powerRows(const GridSize& size, int power)
{
  // Inside of a grid all rows are the same.
  const int side = 2 * power + 1;
  Row inner;
  inner.reset(Eigen::Array3i::Constant(power));
  Graph({side, side, side}).addPower(inner.center(), power, 1, inner);
  return [=, graph = Graph(size)](Row& row) {
    const Eigen::Array3i& at = row.center();
    if ((at >= power).all() && (at + power < Eigen::Array3i(size.x, size.y, size.z)).all())
      row.add(inner);
    else
      graph.addPower(at, power, 1, row);
  };
}

/// The same for the prior of Energy::paper: half the derivative of Σ v_i U(d_i). \param shares v
auto paperRows(const GridSize& size, Prior prior, const std::vector<double>& shares)
{
  return [=, &shares, graph = Graph(size)](Row& row) {
    const auto share = [&](const Eigen::Array3i& v) { return shares[size.index(v.x(), v.y(), v.z())]; };
    const auto add = [&](const Eigen::Array3i& voxel, double entry) { row.add(voxel, entry); };
    if (prior == Prior::membrane) { // U_i = Σ (d_i − d_j)² / n_i
      const auto meanShare = [&](const Eigen::Array3i& v) { return share(v) / graph.degree(v); };
      const auto both = [&](const Eigen::Array3i& a, const Eigen::Array3i& b) { return meanShare(a) + meanShare(b); };
      return graph.forLaplacian(row.center(), 1, both, add);
    }
    // U_i = Σ (l_i − l_j)², l_i the voxel less the mean of its neighbors: L N⁻¹ K N⁻¹ L, K of edges that weigh v_i +
    // v_j, N the numbers of neighbors.
    const auto sum = [&](const Eigen::Array3i& a, const Eigen::Array3i& b) { return share(a) + share(b); };
    graph.forLaplacian(row.center(), 1, Graph::weighsOne, [&](const Eigen::Array3i& first, double entry) {
      graph.forLaplacian(first, entry / graph.degree(first), sum, [&](const Eigen::Array3i& second, double product) {
        graph.forLaplacian(second, product / graph.degree(second), Graph::weighsOne, add);
      });
    });
  };
}

/// \param addRow addRow(voxel, row) adds the entries of a row \throw ResourceLimit if 32 bits cannot count the entries
template <typename AddRow>
SystemMatrix matrixOf(const GridSize& size, Execution& execution, const AddRow& addRow)
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

/// A voxel of a sample's cell, and its weights in the value and the gradient at the sample.
struct CellCorner {
  Eigen::Array3i voxel;
  double value;
  Eigen::Vector3d gradient;
};

/// The voxels of a sample's cell: eight, or fewer if an axis has one voxel only, which then takes the whole weight.
std::vector<CellCorner> cornersOf(const Eigen::Vector3f& position, const GridSize& size)
{
  const Eigen::Array3i sides(size.x, size.y, size.z);
  Eigen::Array3i lower = Eigen::Array3i::Zero();
  Eigen::Array3d upperShare = Eigen::Array3d::Zero();
  for (int axis = 0; axis < 3; ++axis)
    if (sides[axis] > 1) {
      lower[axis] = std::clamp(floorOf(position[axis]), 0, sides[axis] - 2);
      upperShare[axis] = static_cast<double>(position[axis]) - lower[axis];
    }
  std::vector<CellCorner> corners;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3i step(corner & 1, corner >> 1 & 1, corner >> 2);
    if ((step >= sides).any())
      continue;
    const Eigen::Array3d share = (step == 1).select(upperShare, 1 - upperShare),
                         slope = (sides == 1).select(0., 2. * step.cast<double>() - 1);
    corners.push_back(
        {lower + step,
         share.prod(),
         {slope.x() * share.y() * share.z(), share.x() * slope.y() * share.z(), share.x() * share.y() * slope.z()}});
  }
  return corners;
}

/// The row of C that belongs to one voxel, by neighborIndex.
using DataRow = std::array<double, 27>;

/// Adds a sample to the rows of its cell's voxels, and to b. \param rowOf gives the row of a voxel
template <typename RowOf>
void addSample(const GridSize& size, const PointSample& sample, const PointWeights& weights, double unit,
               const RowOf& rowOf, std::vector<double>& b)
{
  const std::vector<CellCorner> corners = cornersOf(sample.position, size);
  for (const CellCorner& corner : corners) {
    const std::int64_t voxel = size.index(corner.voxel.x(), corner.voxel.y(), corner.voxel.z());
    const double value = weights.value * sample.weight * corner.value;
    const Eigen::Vector3d gradient = weights.gradient * sample.weight * corner.gradient;
    DataRow& row = rowOf(voxel);
    for (const CellCorner& other : corners) {
      const Eigen::Array3i step = other.voxel - corner.voxel;
      row[neighborIndex(step.x(), step.y(), step.z())] += value * other.value + gradient.dot(other.gradient);
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
  // All voxels within k steps; for points also the corners of the surrounding cells.
  constexpr std::array<double, 3> ofPrior{7, 25, 63}, withCells{27, 33, 63};
  return (pointwise ? withCells : ofPrior)[order(prior) - 1];
}

LinearSystem assemble(const Observation& observation, const PriorOptions& options, Execution& execution)
{
  validate(options);
  const GridSize size = observation.lattice.size;
  const auto count = static_cast<std::size_t>(size.count());
  const bool isPaper = options.energy == Energy::paper;
  LinearSystem system;
  system.size = size;
  system.coupling.steps = isPaper && options.kind != Prior::membrane ? 3 : order(options.kind);
  system.rightHandSide.assign(count, 0);
  std::vector<double> weights(count, 0), shares(isPaper ? count : 0, 1);
  for (std::size_t n = 0; n < observation.voxels.size(); ++n) {
    const auto voxel = static_cast<std::size_t>(observation.voxels[n]);
    const double w = dataWeight(static_cast<double>(observation.confidences[n]), static_cast<double>(options.beta));
    const double a = w / (1 + w);
    weights[voxel] = isPaper ? a : centerCoefficient(options.kind) * w;
    system.rightHandSide[voxel] = weights[voxel] * static_cast<double>(observation.distances[n]);
    system.isObserved = system.isObserved || w > 0;
    if (isPaper)
      shares[voxel] = 1 - a;
  }
  const auto build = [&](const auto& addPrior) {
    system.matrix = matrixOf(size, execution, [&](std::int64_t voxel, Row& row) {
      addPrior(row);
      row.add(row.center(), weights[voxel]);
    });
  };
  if (isPaper)
    build(paperRows(size, options.kind, shares));
  else
    build(powerRows(size, order(options.kind)));
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
  std::vector<std::int32_t> rowOf(size.count(), none);
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
  const auto addPower = powerRows(size, order(prior));
  system.matrix = matrixOf(size, execution, [&](std::int64_t voxel, Row& row) {
    addPower(row);
    const std::int32_t index = rowOf[voxel];
    if (index == none)
      return;
    const DataRow& data = rows[index];
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
          row.add(row.center() + Eigen::Array3i(x, y, z), data[neighborIndex(x, y, z)]);
  });
  return system;
}

void multiply(const LinearSystem& system, const std::vector<double>& x, std::vector<double>& y, Execution& execution)
{
  forEach(execution, system.size.count(), rowGrain, [&](std::size_t i) { y[i] = rowTimes(system.matrix, i, x); });
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

// SPDX-License-Identifier: BSD-3-Clause
#include "solver/linear_system.h"

#include "base/floor.h"
#include "base/multiversioning.h"
#include "base/vector_kernels.h"
#include "field/prior.h"
#include "observation/observation.h"
#include "options/validation.h"
#include "solver/grid_operator.h"

#include <pcl/surface/mrf/options.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace pcl {
namespace mrf {
namespace {

/// Planes that are computed as one piece of work.
constexpr int grainPlanes = 4;

std::int64_t planeGrain(const GridSize& size)
{
  return size.count() < serialVoxels ? size.z : grainPlanes;
}

/// A row of voxels and the four beside it; at the grid's border the row itself.
struct Rows {
  const double *center, *south, *north, *below, *above;

  Rows(const GridSize& size, const double* values, int y, int z)
  {
    const auto row = [&](int j, int k) {
      return values + size.index(0, std::clamp(j, 0, size.y - 1), std::clamp(k, 0, size.z - 1));
    };
    center = row(y, z);
    south = row(y - 1, z);
    north = row(y + 1, z);
    below = row(y, z - 1);
    above = row(y, z + 1);
  }
};

MRF_MULTIVERSION(void, laplacianOfRow, (int n, const Rows& x, double* __restrict out), (n, x, out))
{
  const double *const c = x.center, *const south = x.south, *const north = x.north, *const below = x.below,
                      *const above = x.above;
  const auto across = [=](int i) { return 4 * c[i] - ((south[i] + north[i]) + (below[i] + above[i])); };
  for (int i = 1; i + 1 < n; ++i)
    out[i] = 2 * c[i] - (c[i - 1] + c[i + 1]) + across(i);
  out[0] = (n > 1 ? c[0] - c[1] : 0) + across(0);
  if (n > 1)
    out[n - 1] = c[n - 1] - c[n - 2] + across(n - 1);
}

/// The same of edges that weigh the mean of their two voxels' v.
MRF_MULTIVERSION(void, weightedLaplacianOfRow, (int n, const Rows& x, const Rows& v, double* __restrict out),
                 (n, x, v, out))
{
  const auto edge = [&](const double* rowX, const double* rowV, int i, int j) {
    return .5 * (v.center[i] + rowV[j]) * (x.center[i] - rowX[j]);
  };
  for (int i = 0; i < n; ++i) {
    const int before = std::max(i - 1, 0), after = std::min(i + 1, n - 1);
    out[i] = (edge(x.center, v.center, i, before) + edge(x.center, v.center, i, after)) +
             (edge(x.south, v.south, i, i) + edge(x.north, v.north, i, i)) +
             (edge(x.below, v.below, i, i) + edge(x.above, v.above, i, i));
  }
}

/// y = L x, or L_v x with weights v.
void laplacian(const GridSize& size, const double* v, const double* x, double* y, Execution& execution)
{
  execution.forRange(size.z, planeGrain(size), [&](std::int64_t begin, std::int64_t end) {
    for (int k = static_cast<int>(begin); k < static_cast<int>(end); ++k)
      for (int j = 0; j < size.y; ++j) {
        double* const out = y + size.index(0, j, k);
        if (v)
          weightedLaplacianOfRow(size.x, Rows(size, x, j, k), Rows(size, v, j, k), out);
        else
          laplacianOfRow(size.x, Rows(size, x, j, k), out);
      }
  });
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
void addSample(const LinearSystem& system, const PointSample& sample, const RowOf& rowOf, std::vector<double>& b)
{
  const Cell cell(sample.position, system.size());
  for (int corner = 0; corner < 8; ++corner) {
    if (!cell.has(corner))
      continue;
    const std::int64_t voxel = cell.voxel(corner, system.size());
    const double value = system.weights.value * sample.weight * cell.value(corner);
    const Eigen::Vector3d gradient = system.weights.gradient * sample.weight * cell.gradient(corner);
    DataRow& row = rowOf(voxel);
    for (int other = 0; other < 8; ++other)
      if (cell.has(other)) {
        const auto step = [&](int axis) { return (other >> axis & 1) - (corner >> axis & 1); };
        row[static_cast<std::size_t>(neighborIndex(step(0), step(1), step(2)))] +=
            value * cell.value(other) + gradient.dot(cell.gradient(other));
      }
    b[static_cast<std::size_t>(voxel)] += system.unit * gradient.dot(sample.normal.cast<double>());
  }
}

DataMatrix matrixOf(const GridSize& size, const std::vector<std::int32_t>& rowOf, const std::vector<DataRow>& rows)
{
  DataMatrix matrix(size.count(), size.count());
  std::int64_t entries = 0;
  for (const DataRow& row : rows)
    entries += std::count_if(row.begin(), row.end(), [](double c) { return c != 0; });
  matrix.reserve(entries);
  for (std::int64_t voxel = 0; voxel < size.count(); ++voxel) {
    matrix.startVec(voxel);
    const std::int32_t index = rowOf[static_cast<std::size_t>(voxel)];
    if (index < 0)
      continue;
    const DataRow& row = rows[static_cast<std::size_t>(index)];
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          if (const double c = row[static_cast<std::size_t>(neighborIndex(dx, dy, dz))]; c != 0)
            matrix.insertBack(voxel, voxel + size.index(dx, dy, dz)) = c;
  }
  matrix.finalize();
  return matrix;
}

} // namespace

void apply(const PriorOperator& prior, const double* x, double* y, std::vector<double>& scratch, Execution& execution)
{
  const auto count = static_cast<std::size_t>(prior.size.count());
  const bool isWeighted = !prior.voxelWeights.empty();
  if (isWeighted && prior.voxelWeights.size() != count)
    throw std::invalid_argument("apply: voxelWeights must be empty or hold one value per voxel");
  const double* const v = isWeighted ? prior.voxelWeights.data() : nullptr;
  const GridSize& size = prior.size;
  scratch.resize(count);
  switch (order(prior.kind)) {
  case 1:
    laplacian(size, v, x, y, execution);
    return;
  case 2:
    laplacian(size, nullptr, x, scratch.data(), execution);
    for (std::size_t i = 0; isWeighted && i < count; ++i)
      scratch[i] *= v[i];
    laplacian(size, nullptr, scratch.data(), y, execution);
    return;
  default:
    laplacian(size, nullptr, x, y, execution);
    laplacian(size, v, y, scratch.data(), execution);
    laplacian(size, nullptr, scratch.data(), y, execution);
  }
}

double dataWeight(double confidence, double beta)
{
  const double a = std::clamp(confidence * beta, 0.0, 1 - 1e-6);
  return a / (1 - a);
}

LinearSystem assemble(const Observation& observation, const PriorOptions& options)
{
  validate(options);
  const GridSize size = observation.lattice.size;
  const auto count = static_cast<std::size_t>(size.count());
  if (observation.distances.size() != observation.voxels.size() ||
      observation.confidences.size() != observation.voxels.size())
    throw std::invalid_argument("assemble: the observation's arrays differ in length");

  const bool weighted = options.energy == Energy::weighted;
  const double coefficient = dataCoefficient(options);
  LinearSystem system;
  system.prior = {size, options.kind, {}};
  if (weighted)
    system.prior.voxelWeights.assign(count, 1);
  std::vector<double> weights(count, 0);
  system.rightHandSide.assign(count, 0);
  for (std::size_t n = 0; n < observation.voxels.size(); ++n) {
    const auto voxel = static_cast<std::size_t>(observation.voxels[n]);
    if (voxel >= count)
      throw std::invalid_argument("assemble: an observed voxel is outside the lattice");
    const double w = dataWeight(static_cast<double>(observation.confidences[n]), static_cast<double>(options.beta));
    const double a = w / (1 + w);
    weights[voxel] = coefficient * (weighted ? a : w);
    system.rightHandSide[voxel] = weights[voxel] * static_cast<double>(observation.distances[n]);
    if (weighted)
      system.prior.voxelWeights[voxel] = 1 - a;
  }
  system.data.resize(size.count(), size.count());
  system.data.reserve(static_cast<std::int64_t>(observation.voxels.size()));
  for (std::int64_t voxel = 0; voxel < size.count(); ++voxel) {
    system.data.startVec(voxel);
    if (const double weight = weights[static_cast<std::size_t>(voxel)]; weight != 0)
      system.data.insertBack(voxel, voxel) = weight;
  }
  system.data.finalize();
  return system;
}

LinearSystem assembleAtPoints(const GridSize& size, Prior prior, std::vector<PointSample> samples,
                              const PointWeights& weights, double unit, Execution& execution)
{
  LinearSystem system;
  system.prior = {size, prior, {}};
  system.rightHandSide.assign(static_cast<std::size_t>(size.count()), 0);
  system.samples = std::move(samples);
  system.weights = weights;
  system.unit = unit;
  constexpr std::int32_t none = -1;
  std::vector<std::int32_t> rowOf(static_cast<std::size_t>(size.count()), none);
  std::vector<DataRow> rows;
  const auto rowAt = [&](std::int64_t voxel) -> DataRow& {
    std::int32_t& index = rowOf[static_cast<std::size_t>(voxel)];
    if (index == none) {
      index = static_cast<std::int32_t>(rows.size());
      rows.push_back({});
    }
    return rows[static_cast<std::size_t>(index)];
  };
  constexpr std::size_t polled = 1 << 16;
  for (std::size_t s = 0; s < system.samples.size(); ++s) {
    addSample(system, system.samples[s], rowAt, system.rightHandSide);
    if (s % polled == 0)
      execution.poll();
  }
  system.data = matrixOf(size, rowOf, rows);
  return system;
}

SystemProduct::SystemProduct(const LinearSystem& system) : system_(system) {}

void SystemProduct::apply(const std::vector<double>& x, std::vector<double>& y, Execution& execution)
{
  mrf::apply(system_.prior, x.data(), y.data(), scratch_, execution);
  const GridSize size = system_.size();
  execution.forRange(size.z, planeGrain(size), [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin * size.planeCount(); i < end * size.planeCount(); ++i)
      for (DataMatrix::InnerIterator entry(system_.data, i); entry; ++entry)
        y[static_cast<std::size_t>(i)] += entry.value() * x[static_cast<std::size_t>(entry.col())];
  });
}

double SystemProduct::residual(const std::vector<double>& x, std::vector<double>& r, Execution& execution)
{
  apply(x, r, execution);
  scaleAndAdd(-1, system_.rightHandSide, r, execution);
  return dotProduct(r, r, execution);
}

double energy(const LinearSystem& system, const std::vector<double>& d, Execution& execution)
{
  std::vector<double> product(d.size());
  SystemProduct(system).apply(d, product, execution);
  const double quadratic = dotProduct(d, product, execution), linear = dotProduct(system.rightHandSide, d, execution);
  return (.5 * quadratic - linear) / static_cast<double>(d.size());
}

double relativeResidual(const LinearSystem& system, const std::vector<double>& d, Execution& execution)
{
  std::vector<double> residual(d.size());
  const double squared = SystemProduct(system).residual(d, residual, execution);
  const double norm = std::sqrt(dotProduct(system.rightHandSide, system.rightHandSide, execution));
  return norm > 0 ? std::sqrt(squared) / norm : std::sqrt(squared);
}

} // namespace mrf
} // namespace pcl

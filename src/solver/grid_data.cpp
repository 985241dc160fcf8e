// SPDX-License-Identifier: BSD-3-Clause
#include "solver/grid_data.h"

#include "base/multiversioning.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

namespace pcl::mrf {
namespace {

/// One lane for each of a cell's four edges along x: (y, z) = (0, 0), (1, 0), (0, 1), (1, 1).
using Lanes = float __attribute__((vector_size(16)));

constexpr Lanes signY = {-1, 1, -1, 1}, signZ = {-1, -1, 1, 1};

/// Trilinear weights of the four edges, and the derivatives of the weights along y and z.
struct EdgeWeights {
  Lanes value, alongY, alongZ;

  MRF_ALWAYS_INLINE EdgeWeights(float v, float w)
  {
    const Lanes ofY = {1 - v, v, 1 - v, v}, ofZ = {1 - w, 1 - w, w, w};
    value = ofY * ofZ;
    alongY = signY * ofZ;
    alongZ = signZ * ofY;
  }
};

/// Values at the 8 voxels of a cell: at the lower and at the upper ends of its edges along x.
struct CellValues {
  Lanes lower, upper;
};

/// Two edges of a cell as two doubles. The values at the two ends of an edge are neighbors in memory, so that they are
/// loaded and stored as one double.
using Edges = double __attribute__((vector_size(16)));

MRF_ALWAYS_INLINE Lanes loadEdges(const float* first, const float* second)
{
  double a, b;
  std::memcpy(&a, first, sizeof(a));
  std::memcpy(&b, second, sizeof(b));
  return reinterpret_cast<Lanes>(Edges{a, b});
}

MRF_ALWAYS_INLINE void addToEdges(const Lanes& values, float* first, float* second)
{
  const auto sums = reinterpret_cast<Edges>(loadEdges(first, second) + values);
  const double a = sums[0], b = sums[1];
  std::memcpy(first, &a, sizeof(a));
  std::memcpy(second, &b, sizeof(b));
}

MRF_ALWAYS_INLINE Lanes evenLanes(const Lanes& a, const Lanes& b)
{
  return Lanes{a[0], a[2], b[0], b[2]};
}

MRF_ALWAYS_INLINE Lanes oddLanes(const Lanes& a, const Lanes& b)
{
  return Lanes{a[1], a[3], b[1], b[3]};
}

MRF_ALWAYS_INLINE CellValues gather(std::int64_t at, std::int64_t stride, const float* plane, const float* above)
{
  const Lanes below = loadEdges(plane + at, plane + at + stride), over = loadEdges(above + at, above + at + stride);
  return {evenLanes(below, over), oddLanes(below, over)};
}

MRF_ALWAYS_INLINE void scatter(const CellValues& values, std::int64_t at, std::int64_t stride, float* plane,
                               float* above)
{
  const Lanes &a = values.lower, &b = values.upper;
  addToEdges(Lanes{a[0], b[0], a[1], b[1]}, plane + at, plane + at + stride);
  addToEdges(Lanes{a[2], b[2], a[3], b[3]}, above + at, above + at + stride);
}

/// The sum over the lanes of each of the four.
MRF_ALWAYS_INLINE Lanes sumsOf(const Lanes& a, const Lanes& b, const Lanes& c, const Lanes& d)
{
  const Lanes ab = evenLanes(a, b) + oddLanes(a, b), cd = evenLanes(c, d) + oddLanes(c, d);
  return evenLanes(ab, cd) + oddLanes(ab, cd);
}

/// c value + Gᵀ gradient of one cell.
MRF_ALWAYS_INLINE CellValues spread(const EdgeWeights& edges, float u, float value, float gx, float gy, float gz)
{
  const Lanes middle = value * edges.value + gy * edges.alongY + gz * edges.alongZ;
  const Lanes upper = gx * edges.value + u * middle;
  return {middle - upper, upper};
}

/// The samples of one layer of cells, ordered by cells, and their place in the windows.
struct SampleLayer {
  const PointSample *begin, *end;
  float lower;         ///< z of the layer's lower plane, voxels
  std::int64_t stride; ///< of the windows' rows
  std::int64_t origin; ///< window index of the lattice's first voxel

  /// Calls body(sample, weights of its cell's edges, share of the edges' upper ends, window index of the lowest voxel).
  template <typename Body>
  MRF_ALWAYS_INLINE void forEach(const Body& body) const
  {
    for (const PointSample* s = begin; s != end; ++s) {
      const int i = floorOf(s->position.x()), j = floorOf(s->position.y());
      body(*s, EdgeWeights(s->position.y() - static_cast<float>(j), s->position.z() - lower),
           s->position.x() - static_cast<float>(i), origin + i + stride * j);
    }
  }
};

MRF_MULTIVERSION(void, addSampleProducts,
                 (const SampleLayer& layer, float value, float gradient, const float* x, const float* xAbove, float* y,
                  float* yAbove),
                 (layer, value, gradient, x, xAbove, y, yAbove))
{
  layer.forEach([&](const PointSample& s, const EdgeWeights& edges, float u, std::int64_t at) {
    const CellValues in = gather(at, layer.stride, x, xAbove);
    const Lanes difference = in.upper - in.lower, middle = in.lower + u * difference;
    const Lanes weights = s.weight * Lanes{value, gradient, gradient, gradient};
    const Lanes sums =
        weights * sumsOf(edges.value * middle, edges.value * difference, edges.alongY * middle, edges.alongZ * middle);
    scatter(spread(edges, u, sums[0], sums[1], sums[2], sums[3]), at, layer.stride, y, yAbove);
  });
}

/// Where each layer of a grid begins in samples ordered by cells, and the end.
std::vector<std::size_t> layersOf(const std::vector<PointSample>& samples, const GridSize& grid)
{
  std::vector<std::size_t> begin(grid.z + 1, 0);
  for (const PointSample& sample : samples)
    ++begin[floorOf(sample.position.z()) + gridMargin + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  return begin;
}

class PointData : public GridData {
public:
  PointData(const std::vector<PointSample>& samples, const VoxelSet& voxels, const PointWeights& weights, double unit)
      : samples_(samples), voxels_(voxels), value_(static_cast<float>(weights.value)),
        gradient_(static_cast<float>(weights.gradient)), unit_(static_cast<float>(unit)),
        layerBegin_(layersOf(samples, voxels.size()))
  {}

  void addProduct(int z, const float* x, const float* xAbove, float* y, float* yAbove) const override
  {
    addSampleProducts(layerAt(z), value_, gradient_, x, xAbove, y, yAbove);
  }

  void addRowSums(int z, float* y, float* yAbove) const override
  {
    const SampleLayer layer = layerAt(z);
    layer.forEach([&](const PointSample& s, const EdgeWeights& edges, float u, std::int64_t at) {
      // The voxels' weights for the value sum to 1, their absolute weights for each derivative to 2.
      const float value = value_ * s.weight, gradient = 2 * gradient_ * s.weight;
      const Lanes across = edges.alongY * signY + edges.alongZ * signZ;
      const Lanes both = value * edges.value + gradient * across, alongX = gradient * edges.value;
      scatter({(1 - u) * both + alongX, u * both + alongX}, at, layer.stride, y, yAbove);
    });
  }

  void addRightHandSide(int z, const NormalDraws* draws, float* y, float* yAbove) const override
  {
    const SampleLayer layer = layerAt(z);
    layer.forEach([&](const PointSample& s, const EdgeWeights& edges, float u, std::int64_t at) {
      float value = 0;
      Eigen::Vector3f gradient = gradient_ * s.weight * unit_ * s.normal;
      if (draws) {
        const auto index = static_cast<std::uint64_t>(2 * (&s - samples_.data()));
        const std::array<float, 2> first = draws->pair(NormalDraws::Kind::samples, index),
                                   second = draws->pair(NormalDraws::Kind::samples, index + 1);
        value = std::sqrt(value_ * s.weight) * first[0];
        gradient = std::sqrt(gradient_ * s.weight) * Eigen::Vector3f(first[1], second[0], second[1]);
      }
      scatter(spread(edges, u, value, gradient.x(), gradient.y(), gradient.z()), at, layer.stride, y, yAbove);
    });
  }

  bool isDiagonal() const override { return false; }

  /// Calls body(window index of the cell's lowest voxel, the matrix of the sample) for the samples of a layer.
  template <typename Body>
  void forEachInLayer(int z, const Body& body) const
  {
    layerAt(z).forEach([&](const PointSample& s, const EdgeWeights& edges, float u, std::int64_t at) {
      // Rows: the value and the derivatives at the sample, as shares of the cell's voxels.
      Eigen::Matrix<float, 4, 8> rows;
      for (int corner = 0; corner < 8; ++corner) {
        const int edge = corner >> 1;
        const float alongX = corner & 1 ? u : 1 - u, slope = corner & 1 ? 1.f : -1.f;
        rows.col(corner) << alongX * edges.value[edge], slope * edges.value[edge], alongX * edges.alongY[edge],
            alongX * edges.alongZ[edge];
      }
      const Eigen::Vector4f weights = s.weight * Eigen::Vector4f(value_, gradient_, gradient_, gradient_);
      body(at, (rows.transpose() * weights.asDiagonal() * rows).eval());
    });
  }

private:
  /// Empty outside the grid.
  SampleLayer layerAt(int z) const
  {
    const bool isInside = z >= 0 && z < voxels_.size().z;
    const PointSample* begin = isInside ? samples_.data() + layerBegin_[z] : nullptr;
    const PointSample* end = isInside ? samples_.data() + layerBegin_[z + 1] : nullptr;
    return {begin, end, static_cast<float>(z - gridMargin), voxels_.windowStride(),
            voxels_.windowIndex(gridMargin, gridMargin)};
  }

  const std::vector<PointSample>& samples_; ///< by layers
  const VoxelSet& voxels_;
  float value_, gradient_, unit_;
  std::vector<std::size_t> layerBegin_;
};

/// The 8 voxels of a cell: x runs fastest, then y, then z.
using Corners = float __attribute__((vector_size(32)));
using CornerEdges = double __attribute__((vector_size(32)));

/// The sum of the matrices of all samples of a cell.
struct CellBlock {
  std::array<std::array<float, 8>, 8> columns{}; ///< of the 8 × 8 matrix, symmetric
  std::int64_t at = 0;                           ///< window index of the lowest voxel
};

MRF_MULTIVERSION(void, addBlockProducts,
                 (const CellBlock* begin, const CellBlock* end, std::int64_t stride, const float* x,
                  const float* xAbove, float* y, float* yAbove),
                 (begin, end, stride, x, xAbove, y, yAbove))
{
  const auto forEdges = [=](std::int64_t at, auto* plane, auto* above, const auto& body) {
    body(0, plane + at);
    body(1, plane + at + stride);
    body(2, above + at);
    body(3, above + at + stride);
  };
  for (const CellBlock* block = begin; block != end; ++block) {
    CornerEdges in{};
    forEdges(block->at, x, xAbove, [&](int edge, const float* values) {
      double both;
      std::memcpy(&both, values, sizeof(both));
      in[edge] = both;
    });
    const auto values = reinterpret_cast<Corners>(in);
    std::array<Corners, 8> a;
    std::memcpy(a.data(), block->columns.data(), sizeof(a));
    const Corners sums = ((a[0] * values[0] + a[1] * values[1]) + (a[2] * values[2] + a[3] * values[3])) +
                         ((a[4] * values[4] + a[5] * values[5]) + (a[6] * values[6] + a[7] * values[7]));
    forEdges(block->at, y, yAbove, [&](int edge, float* out) {
      out[0] += sums[2 * edge];
      out[1] += sums[2 * edge + 1];
    });
  }
}

/// The number of cells that hold samples. \param samples ordered by cells
std::size_t occupiedCells(const std::vector<PointSample>& samples)
{
  std::size_t cells = 0;
  Eigen::Array3i last;
  for (const PointSample& sample : samples) {
    const Eigen::Array3i cell(floorOf(sample.position.x()), floorOf(sample.position.y()), floorOf(sample.position.z()));
    if (cells == 0 || (cell != last).any())
      ++cells;
    last = cell;
  }
  return cells;
}

/// The data of points with one matrix per cell: a product with it costs less than one with two samples.
class CellData final : public PointData {
public:
  CellData(const std::vector<PointSample>& samples, const VoxelSet& voxels, const PointWeights& weights, double unit)
      : PointData(samples, voxels, weights, unit), stride_(voxels.windowStride())
  {
    blocks_.reserve(occupiedCells(samples));
    for (int layer = 0; layer < voxels.size().z; ++layer) {
      blockBegin_.push_back(blocks_.size());
      forEachInLayer(layer, [&](std::int64_t at, const Eigen::Matrix<float, 8, 8>& matrix) {
        if (blocks_.size() == blockBegin_.back() || blocks_.back().at != at) {
          blocks_.emplace_back();
          blocks_.back().at = at;
        }
        for (int j = 0; j < 8; ++j)
          for (int i = 0; i < 8; ++i)
            blocks_.back().columns[j][i] += matrix(i, j);
      });
    }
    blockBegin_.push_back(blocks_.size());
  }

  void addProduct(int z, const float* x, const float* xAbove, float* y, float* yAbove) const override
  {
    if (isInside(z))
      addBlockProducts(begin(z), begin(z + 1), stride_, x, xAbove, y, yAbove);
  }

  void addRowSums(int z, float* y, float* yAbove) const override
  {
    if (!isInside(z))
      return;
    for (const CellBlock* block = begin(z); block != begin(z + 1); ++block)
      for (int corner = 0; corner < 8; ++corner) {
        float sum = 0;
        for (const std::array<float, 8>& column : block->columns)
          sum += std::abs(column[corner]);
        // GCC 12 miscompiles (corner < 4 ? y : yAbove)[...] += sum under its undefined-behavior sanitizer.
        float* const plane = corner < 4 ? y : yAbove;
        plane[block->at + (corner & 1) + (corner >> 1 & 1) * stride_] += sum;
      }
  }

private:
  bool isInside(int z) const { return z >= 0 && z + 1 < static_cast<int>(blockBegin_.size()); }
  const CellBlock* begin(int z) const { return blocks_.data() + blockBegin_[z]; }

  std::int64_t stride_;
  std::vector<CellBlock> blocks_;
  std::vector<std::size_t> blockBegin_; ///< per layer, and the end
};

class VoxelData final : public GridData {
public:
  VoxelData(const VoxelSet& voxels, std::vector<float> weights, std::vector<float> targets)
      : voxels_(voxels), weights_(std::move(weights)), targets_(std::move(targets))
  {}

  void addProduct(int z, const float* x, const float*, float* y, float*) const override
  {
    kernels::addWeighted(voxels_.plane(z), weights_.data() + voxels_.planeFirst(z), x, y);
  }

  void addRowSums(int z, float* y, float*) const override
  {
    kernels::addToWindow(voxels_.plane(z), 1, weights_.data() + voxels_.planeFirst(z), y);
  }

  void addRightHandSide(int z, const NormalDraws* draws, float* y, float*) const override
  {
    for (const Run& run : voxels_.plane(z))
      for (std::int32_t i = 0; i < run.count; ++i) {
        const auto at = static_cast<std::size_t>(voxels_.planeFirst(z) + run.first + i);
        if (draws && weights_[at] > 0)
          y[run.at + i] += std::sqrt(weights_[at]) * draws->pair(NormalDraws::Kind::samples, at)[0];
        else if (!draws && !targets_.empty())
          y[run.at + i] += weights_[at] * targets_[at];
      }
  }

  bool isDiagonal() const override { return true; }

private:
  const VoxelSet& voxels_;
  std::vector<float> weights_, targets_;
};

} // namespace

std::unique_ptr<GridData> makePointData(const std::vector<PointSample>& samples, const VoxelSet& voxels,
                                        const PointWeights& weights, double unit, bool isWhole)
{
  if (isWhole || samples.size() * sizeof(PointSample) > occupiedCells(samples) * sizeof(CellBlock))
    return std::make_unique<CellData>(samples, voxels, weights, unit);
  return std::make_unique<PointData>(samples, voxels, weights, unit);
}

std::unique_ptr<GridData> makeVoxelData(const VoxelSet& voxels, std::vector<float> weights, std::vector<float> targets)
{
  return std::make_unique<VoxelData>(voxels, std::move(weights), std::move(targets));
}

VoxelSet observedVoxels(const std::vector<PointSample>& samples, const GridSize& grid, Execution& execution)
{
  const std::vector<std::size_t> layerBegin = layersOf(samples, grid);
  return VoxelSet(grid, execution, [&](int z, MaskPlane& mask) {
    // First the lowest voxel of each cell.
    for (int layer = std::max(z - 1, 0); layer <= z; ++layer)
      for (std::size_t s = layerBegin[layer]; s < layerBegin[layer + 1]; ++s)
        mask.set(floorOf(samples[s].position.x()) + gridMargin, floorOf(samples[s].position.y()) + gridMargin);
    mask.growUpwards();
  });
}

} // namespace pcl::mrf

#include "band_data.h"

#include "floor.h"
#include "multiversioning.h"

#include <algorithm>
#include <cstring>

namespace pcl {
namespace mrf {
namespace {

/// One lane per edge of the cell along x: (y, z) = (0, 0), (1, 0), (0, 1), (1, 1).
using Lanes = float __attribute__((vector_size(16)));

constexpr Lanes signY = {-1, 1, -1, 1}, signZ = {-1, -1, 1, 1};

/// Trilinear weights of the four edges, and what they become when differentiated along y and z.
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

/// The 8 voxels of a cell: those at the lower and at the upper end of each edge along x.
struct CellValues {
  Lanes lower, upper;
};

/// Two edges of a cell, each of two voxels that are neighbours along x, as if they were doubles: an edge is then loaded
/// and stored at once.
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

/// The sums over the lanes of each.
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

/// The samples of one layer of cells, ordered by cells, and where in the windows they are.
struct SampleLayer {
  const PointSample *begin, *end;
  float lower;         ///< of the cells, along z
  std::int64_t stride; ///< of the windows
  std::int64_t origin; ///< window index of the lattice's first voxel

  /// Calls body(sample, weights of its cell's edges, share of their upper ends, window index of the lowest voxel).
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
  std::vector<std::size_t> begin(static_cast<std::size_t>(grid.z) + 1, 0);
  for (const PointSample& sample : samples)
    ++begin[static_cast<std::size_t>(floorOf(sample.position.z()) + bandMargin) + 1];
  for (std::size_t layer = 1; layer < begin.size(); ++layer)
    begin[layer] += begin[layer - 1];
  return begin;
}

class PointBandData final : public BandData {
public:
  PointBandData(const std::vector<PointSample>& samples, const Band& band, const PointWeights& weights, double unit)
      : samples_(samples), band_(band), value_(static_cast<float>(weights.value)),
        gradient_(static_cast<float>(weights.gradient)), unit_(static_cast<float>(unit)),
        layerBegin_(layersOf(samples, band.size()))
  {}

  void addProduct(int z, const float* x, const float* xAbove, float* y, float* yAbove) const override
  {
    addSampleProducts(layerAt(z), value_, gradient_, x, xAbove, y, yAbove);
  }

  void addRowSums(int z, float* y, float* yAbove) const override
  {
    const SampleLayer layer = layerAt(z);
    layer.forEach([&](const PointSample& s, const EdgeWeights& edges, float u, std::int64_t at) {
      // The shares of a value sum to 1, the absolute ones of a derivative to 2.
      const float value = value_ * s.weight, gradient = 2 * gradient_ * s.weight;
      const Lanes across = edges.alongY * signY + edges.alongZ * signZ;
      const Lanes both = value * edges.value + gradient * across, alongX = gradient * edges.value;
      scatter({(1 - u) * both + alongX, u * both + alongX}, at, layer.stride, y, yAbove);
    });
  }

  void addRightHandSide(int z, float* y, float* yAbove) const override
  {
    const SampleLayer layer = layerAt(z);
    layer.forEach([&](const PointSample& s, const EdgeWeights& edges, float u, std::int64_t at) {
      const Eigen::Vector3f g = gradient_ * s.weight * unit_ * s.normal;
      scatter(spread(edges, u, 0, g.x(), g.y(), g.z()), at, layer.stride, y, yAbove);
    });
  }

  bool isDiagonal() const override { return false; }

private:
  /// Empty outside the grid.
  SampleLayer layerAt(int z) const
  {
    const bool isInside = z >= 0 && z < band_.size().z;
    const PointSample* begin = isInside ? samples_.data() + layerBegin_[static_cast<std::size_t>(z)] : nullptr;
    const PointSample* end = isInside ? samples_.data() + layerBegin_[static_cast<std::size_t>(z) + 1] : nullptr;
    return {begin, end, static_cast<float>(z - bandMargin), band_.windowStride(),
            band_.windowIndex(bandMargin, bandMargin)};
  }

  const std::vector<PointSample>& samples_; ///< by layers
  const Band& band_;
  float value_, gradient_, unit_;
  std::vector<std::size_t> layerBegin_;
};

class VoxelBandData final : public BandData {
public:
  VoxelBandData(const Band& band, std::vector<float> weights, std::vector<float> targets)
      : band_(band), weights_(std::move(weights)), targets_(std::move(targets))
  {}

  void addProduct(int z, const float* x, const float*, float* y, float*) const override
  {
    kernels::addWeighted(band_.plane(z), weights_.data() + band_.planeFirst(z), x, y);
  }

  void addRowSums(int z, float* y, float*) const override
  {
    kernels::addToWindow(band_.plane(z), 1, weights_.data() + band_.planeFirst(z), y);
  }

  void addRightHandSide(int z, float* y, float*) const override
  {
    if (targets_.empty())
      return;
    for (const Run& run : band_.plane(z)) {
      const std::int64_t first = band_.planeFirst(z) + run.first;
      for (std::int32_t i = 0; i < run.count; ++i)
        y[run.at + i] += weights_[static_cast<std::size_t>(first + i)] * targets_[static_cast<std::size_t>(first + i)];
    }
  }

  bool isDiagonal() const override { return true; }

private:
  const Band& band_;
  std::vector<float> weights_, targets_;
};

} // namespace

std::unique_ptr<BandData> makePointBandData(const std::vector<PointSample>& samples, const Band& band,
                                            const PointWeights& weights, double unit)
{
  return std::make_unique<PointBandData>(samples, band, weights, unit);
}

std::unique_ptr<BandData> makeVoxelBandData(const Band& band, std::vector<float> weights, std::vector<float> targets)
{
  return std::make_unique<VoxelBandData>(band, std::move(weights), std::move(targets));
}

Band observedBand(const std::vector<PointSample>& samples, const GridSize& grid, Execution& execution)
{
  const std::vector<std::size_t> layerBegin = layersOf(samples, grid);
  return Band(
      grid,
      [&](int z, MaskPlane& mask) {
        // The cells first, by their lowest voxels.
        for (int layer = std::max(z - 1, 0); layer <= z; ++layer)
          for (std::size_t s = layerBegin[static_cast<std::size_t>(layer)];
               s < layerBegin[static_cast<std::size_t>(layer) + 1]; ++s)
            mask.set(floorOf(samples[s].position.x()) + bandMargin, floorOf(samples[s].position.y()) + bandMargin);
        mask.growUpwards();
      },
      0, execution);
}

} // namespace mrf
} // namespace pcl

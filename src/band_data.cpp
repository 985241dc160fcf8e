#include "band_data.h"

#include <algorithm>
#include <cmath>

namespace pcl {
namespace mrf {
namespace {

/// One sample in its cell: shares of the upper voxels, weight, window index of the lowest voxel.
struct CellSample {
  float u, v, w, weight;
  std::int32_t at;
};

/// One lane per edge of the cell along x: (y, z) = (0, 0), (1, 0), (0, 1), (1, 1).
using Lanes = float __attribute__((vector_size(16)));

constexpr Lanes signY = {-1, 1, -1, 1}, signZ = {-1, -1, 1, 1};

/// Trilinear weights of the four edges, and what they become when differentiated along y and z.
struct EdgeWeights {
  Lanes value, alongY, alongZ;

  EdgeWeights(float v, float w)
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

CellValues gather(std::int64_t at, std::int64_t stride, const float* plane, const float* above)
{
  const float *a = plane + at, *b = a + stride, *c = above + at, *d = c + stride;
  return {Lanes{a[0], b[0], c[0], d[0]}, Lanes{a[1], b[1], c[1], d[1]}};
}

void scatter(const CellValues& values, std::int64_t at, std::int64_t stride, float* plane, float* above)
{
  float *const a = plane + at, *const b = a + stride, *const c = above + at, *const d = c + stride;
  a[0] += values.lower[0];
  a[1] += values.upper[0];
  b[0] += values.lower[1];
  b[1] += values.upper[1];
  c[0] += values.lower[2];
  c[1] += values.upper[2];
  d[0] += values.lower[3];
  d[1] += values.upper[3];
}

float sumOf(const Lanes& lanes)
{
  return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

/// c value + Gᵀ gradient of one cell.
CellValues spread(const EdgeWeights& edges, float u, float value, float gx, float gy, float gz)
{
  const Lanes middle = value * edges.value + gy * edges.alongY + gz * edges.alongZ;
  const Lanes upper = gx * edges.value + u * middle;
  return {middle - upper, upper};
}

class PointBandData final : public BandData {
public:
  PointBandData(const std::vector<PointSample>& samples, const Band& band, const PointWeights& weights, double unit,
                bool withNormals)
      : stride_(band.windowStride()), value_(static_cast<float>(weights.value)),
        gradient_(static_cast<float>(weights.gradient)), unit_(static_cast<float>(unit)),
        layerBegin_(static_cast<std::size_t>(band.size().z) + 1, 0)
  {
    samples_.reserve(samples.size());
    if (withNormals)
      normals_.reserve(samples.size());
    for (const PointSample& sample : samples) {
      const Eigen::Array3i cell = sample.position.array().floor().cast<int>();
      const Eigen::Vector3f share = sample.position - cell.cast<float>().matrix();
      samples_.push_back({share.x(), share.y(), share.z(), sample.weight,
                          band.windowIndex(cell.x() + bandMargin, cell.y() + bandMargin)});
      if (withNormals)
        normals_.push_back(sample.normal);
      ++layerBegin_[static_cast<std::size_t>(cell.z() + bandMargin) + 1];
    }
    for (std::size_t layer = 1; layer < layerBegin_.size(); ++layer)
      layerBegin_[layer] += layerBegin_[layer - 1];
  }

  void addProduct(int z, const float* x, const float* xAbove, float* y, float* yAbove) const override
  {
    forLayer(z, [&](const CellSample& s, std::size_t) {
      const EdgeWeights edges(s.v, s.w);
      const CellValues in = gather(s.at, stride_, x, xAbove);
      const Lanes difference = in.upper - in.lower, middle = in.lower + s.u * difference;
      const float value = value_ * s.weight, gradient = gradient_ * s.weight;
      scatter(spread(edges, s.u, value * sumOf(edges.value * middle), gradient * sumOf(edges.value * difference),
                     gradient * sumOf(edges.alongY * middle), gradient * sumOf(edges.alongZ * middle)),
              s.at, stride_, y, yAbove);
    });
  }

  void addRowSums(int z, float* y, float* yAbove) const override
  {
    forLayer(z, [&](const CellSample& s, std::size_t) {
      // The shares of a value sum to 1, the absolute ones of a derivative to 2.
      const EdgeWeights edges(s.v, s.w);
      const float value = value_ * s.weight, gradient = 2 * gradient_ * s.weight;
      const Lanes across = edges.alongY * signY + edges.alongZ * signZ;
      const Lanes both = value * edges.value + gradient * across, alongX = gradient * edges.value;
      scatter({(1 - s.u) * both + alongX, s.u * both + alongX}, s.at, stride_, y, yAbove);
    });
  }

  void addRightHandSide(int z, float* y, float* yAbove) const override
  {
    if (normals_.empty())
      return;
    forLayer(z, [&](const CellSample& s, std::size_t index) {
      const Eigen::Vector3f g = gradient_ * s.weight * unit_ * normals_[index];
      scatter(spread(EdgeWeights(s.v, s.w), s.u, 0, g.x(), g.y(), g.z()), s.at, stride_, y, yAbove);
    });
  }

  bool isDiagonal() const override { return false; }

private:
  template <typename Body>
  void forLayer(int z, const Body& body) const
  {
    if (z < 0 || z + 1 >= static_cast<int>(layerBegin_.size()))
      return;
    for (std::size_t s = layerBegin_[static_cast<std::size_t>(z)]; s < layerBegin_[static_cast<std::size_t>(z) + 1];
         ++s)
      body(samples_[s], s);
  }

  std::int64_t stride_;
  float value_, gradient_, unit_;
  std::vector<CellSample> samples_; ///< by layers
  std::vector<Eigen::Vector3f> normals_;
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
                                            const PointWeights& weights, double unit, bool withNormals)
{
  return std::make_unique<PointBandData>(samples, band, weights, unit, withNormals);
}

std::unique_ptr<BandData> makeVoxelBandData(const Band& band, std::vector<float> weights, std::vector<float> targets)
{
  return std::make_unique<VoxelBandData>(band, std::move(weights), std::move(targets));
}

Band observedBand(const std::vector<PointSample>& samples, const GridSize& grid, Execution& execution)
{
  std::vector<std::size_t> layerBegin(static_cast<std::size_t>(grid.z) + 1, 0);
  for (const PointSample& sample : samples)
    ++layerBegin[static_cast<std::size_t>(std::floor(sample.position.z())) + bandMargin + 1];
  for (std::size_t layer = 1; layer < layerBegin.size(); ++layer)
    layerBegin[layer] += layerBegin[layer - 1];
  return Band(
      grid,
      [&](int z, MaskPlane& mask) {
        for (int layer = std::max(z - 1, 0); layer <= z; ++layer)
          for (std::size_t s = layerBegin[static_cast<std::size_t>(layer)];
               s < layerBegin[static_cast<std::size_t>(layer) + 1]; ++s) {
            const int x = static_cast<int>(std::floor(samples[s].position.x())) + bandMargin;
            const int y = static_cast<int>(std::floor(samples[s].position.y())) + bandMargin;
            mask.setRange(x, x + 2, y);
            mask.setRange(x, x + 2, y + 1);
          }
      },
      0, execution);
}

} // namespace mrf
} // namespace pcl

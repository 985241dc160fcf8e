#include <pcl/surface/mrf/point_observation.h>

#include "floor.h"
#include "multiversioning.h"
#include "spatial_sort.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

namespace pcl {
namespace mrf {
namespace {

/// Planes of voxels that are assembled as one piece of work.
constexpr int grainPlanes = 4;

/// Samples in a merged one are closer together than this, in voxels of the coarser grid: what a grid's interpolant
/// cannot tell apart anyway.
constexpr float mergeSide = .5f;

int neighbourIndex(int dx, int dy, int dz)
{
  return (dx + 1) + 3 * ((dy + 1) + 3 * (dz + 1));
}

/// The weighted mean of samples.
class SampleMean {
public:
  void add(const PointSample& sample)
  {
    position_ += sample.weight * sample.position.cast<double>();
    normal_ += sample.weight * sample.normal.cast<double>();
    weight_ += sample.weight;
  }

  PointSample sample() const
  {
    return {(position_ / weight_).cast<float>(), (normal_ / weight_).cast<float>(), static_cast<float>(weight_)};
  }

private:
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero(), normal_ = Eigen::Vector3d::Zero();
  double weight_ = 0;
};

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
};

/// Samples per piece of parallel work.
constexpr std::size_t sampleGrain = 1 << 14;

/// Calls body(i) for all samples, concurrently.
template <typename Body>
void forSamples(std::size_t count, Execution& execution, const Body& body)
{
  execution.forRange(static_cast<std::int64_t>(count), sampleGrain, [&](std::int64_t begin, std::int64_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
      body(i);
  });
}

Eigen::Array3i cubeOf(const PointSample& sample, float side)
{
  const Eigen::Vector3f position = sample.position / side;
  return {floorOf(position.x()), floorOf(position.y()), floorOf(position.z())};
}

struct CubeBounds {
  Eigen::Array3i lower = Eigen::Array3i::Constant(std::numeric_limits<int>::max()), upper = -lower;

  void include(const CubeBounds& other)
  {
    lower = lower.min(other.lower);
    upper = upper.max(other.upper);
  }
};

/// Of the cubes that samples lie in.
CubeBounds bounds(const std::vector<PointSample>& samples, float side, Execution& execution)
{
  std::vector<CubeBounds> pieces((samples.size() + sampleGrain - 1) / sampleGrain);
  execution.forRange(static_cast<std::int64_t>(samples.size()), sampleGrain, [&](std::int64_t begin, std::int64_t end) {
    CubeBounds piece;
    for (auto s = static_cast<std::size_t>(begin); s < static_cast<std::size_t>(end); ++s) {
      const Eigen::Array3i cube = cubeOf(samples[s], side);
      piece.include({cube, cube});
    }
    pieces[static_cast<std::size_t>(begin) / sampleGrain] = piece;
  });
  CubeBounds result;
  for (const CubeBounds& piece : pieces)
    result.include(piece);
  return result;
}

/// Samples in the order of the cubes they lie in: z, then y, then x; those of a cube in the order given.
struct CubeOrder {
  SortKeys keys; ///< the same for the same cube
  std::vector<std::uint32_t> order;

  CubeOrder(const std::vector<PointSample>& samples, float side, Execution& execution)
      : keys(samples.size()), order(samples.size())
  {
    if (samples.empty())
      return;
    const CubeBounds range = bounds(samples, side, execution);
    const Eigen::Array<std::uint64_t, 3, 1> size = (range.upper - range.lower + 1).cast<std::uint64_t>();
    forSamples(samples.size(), execution, [&](std::size_t s) {
      const Eigen::Array<std::uint64_t, 3, 1> cube = (cubeOf(samples[s], side) - range.lower).cast<std::uint64_t>();
      keys[s] = cube.x() + size.x() * (cube.y() + size.y() * cube.z());
      order[s] = static_cast<std::uint32_t>(s);
    });
    sortByKey(keys, order, execution);
  }
};

/// Sorts the samples by the planes of cells they lie in. \return where each plane begins, one entry more than planes
std::vector<std::size_t> sortByPlane(std::vector<PointSample>& samples, const GridSize& size)
{
  const auto planes = static_cast<std::size_t>(std::max(size.z - 1, 1));
  const auto planeOf = [&](const PointSample& s) {
    return static_cast<std::size_t>(AxisCell(s.position.z(), size.z).lower);
  };
  std::vector<std::size_t> begin(planes + 1, 0);
  for (const PointSample& sample : samples)
    ++begin[planeOf(sample) + 1];
  for (std::size_t p = 1; p <= planes; ++p)
    begin[p] += begin[p - 1];
  std::vector<PointSample> sorted(samples.size());
  std::vector<std::size_t> next = begin;
  for (const PointSample& sample : samples)
    sorted[next[planeOf(sample)]++] = sample;
  samples = std::move(sorted);
  return begin;
}

/// The rows of C that belong to one plane of voxels.
template <typename Real>
struct PlaneRows {
  std::vector<std::int32_t> voxels; ///< indices into the plane, ascending; those at its edges last
  std::size_t inner = 0;            ///< how many rows have all their neighbours inside the plane's edges
  std::vector<Real> coefficients;   ///< 27 per row, by neighbourIndex
};

template <typename Real>
MRF_ALWAYS_INLINE Real rowOfThree(const Real* c, const Real* x)
{
  return c[0] * x[-1] + c[1] * x[0] + c[2] * x[1];
}

#define MRF_ADD_ROWS(Real)                                                                                             \
  MRF_MULTIVERSION(void, addRows,                                                                                      \
                   (std::size_t rows, const std::int32_t* voxels, const Real* coefficients, std::int64_t stride,       \
                    const Real* below, const Real* centre, const Real* above, Real* y),                                \
                   (rows, voxels, coefficients, stride, below, centre, above, y))                                      \
  {                                                                                                                    \
    for (std::size_t row = 0; row < rows; ++row) {                                                                     \
      const std::int64_t i = voxels[row];                                                                              \
      const Real* c = coefficients + 27 * row;                                                                         \
      const Real a =                                                                                                   \
          rowOfThree(c, below + i - stride) + rowOfThree(c + 3, below + i) + rowOfThree(c + 6, below + i + stride);    \
      const Real b = rowOfThree(c + 9, centre + i - stride) + rowOfThree(c + 12, centre + i) +                         \
                     rowOfThree(c + 15, centre + i + stride);                                                          \
      const Real d = rowOfThree(c + 18, above + i - stride) + rowOfThree(c + 21, above + i) +                          \
                     rowOfThree(c + 24, above + i + stride);                                                           \
      y[i] += a + b + d;                                                                                               \
    }                                                                                                                  \
  }

MRF_ADD_ROWS(float)
MRF_ADD_ROWS(double)
#undef MRF_ADD_ROWS

template <typename Real>
class PointDataTerm final : public DataTerm<Real> {
public:
  PointDataTerm(GridSize size, std::vector<PointSample> samples, const PointWeights& weights, double unit,
                Execution& execution)
      : size_(size), samples_(std::move(samples)), weights_(weights), planes_(static_cast<std::size_t>(size.z)),
        rightHandSide_(static_cast<std::size_t>(size.count()), 0), diagonal_(rightHandSide_)
  {
    const std::vector<std::size_t> planeBegins = sortByPlane(samples_, size_);
    execution.forRange(size_.z, grainPlanes, [&](std::int64_t begin, std::int64_t end) {
      std::vector<std::int32_t> rowOf(static_cast<std::size_t>(size_.planeCount()));
      for (int z = static_cast<int>(begin); z < static_cast<int>(end); ++z)
        assemblePlane(z, planeBegins, unit, rowOf);
    });
    spectralBound_ = estimateSpectralBound(execution);
  }

  GridSize size() const override { return size_; }

  void addPlaneProduct(int z, const Real* below, const Real* centre, const Real* above, Real* y) const override
  {
    const PlaneRows<Real>& plane = planes_[static_cast<std::size_t>(z)];
    addRows(plane.inner, plane.voxels.data(), plane.coefficients.data(), size_.x, below, centre, above, y);
    for (std::size_t row = plane.inner; row < plane.voxels.size(); ++row)
      forEachEntry(plane, row, [&](int dz, std::int64_t voxel, Real coefficient) {
        y[plane.voxels[row]] += coefficient * (dz < 0 ? below : dz > 0 ? above : centre)[voxel];
      });
  }

  const std::vector<Real>& rightHandSide() const override { return rightHandSide_; }
  const std::vector<Real>& diagonal() const override { return diagonal_; }
  Real spectralBound() const override { return spectralBound_; }
  bool isDiagonal() const override { return false; }

  std::unique_ptr<DataTerm<Real>> coarsened(Prior prior, Execution& execution) const override
  {
    const auto halve = [](float u, int n) { return n == 1 ? u : (u - .5f) / 2; };
    std::vector<PointSample> samples = samples_;
    for (PointSample& sample : samples)
      sample.position = {halve(sample.position.x(), size_.x), halve(sample.position.y(), size_.y),
                         halve(sample.position.z(), size_.z)};
    const GridSize coarse = size_.coarsened();
    int children = 1;
    for (const int n : {size_.x, size_.y, size_.z})
      children *= n == 1 ? 1 : 2;
    const double scale = coarseShare(prior) * std::pow(4.0, order(prior)) / children;
    return std::make_unique<PointDataTerm>(coarse, merge(samples, mergeSide, execution),
                                           PointWeights{weights_.value * scale, weights_.gradient * scale / 4}, 1,
                                           execution);
  }

  void appendEntries(std::vector<Eigen::Triplet<double, std::int64_t>>& entries) const override
  {
    for (int z = 0; z < size_.z; ++z) {
      const PlaneRows<Real>& plane = planes_[static_cast<std::size_t>(z)];
      const std::int64_t first = size_.planeCount() * z;
      for (std::size_t row = 0; row < plane.voxels.size(); ++row)
        forEachEntry(plane, row, [&](int dz, std::int64_t voxel, Real coefficient) {
          entries.emplace_back(first + plane.voxels[row], first + size_.planeCount() * dz + voxel,
                               static_cast<double>(coefficient));
        });
    }
  }

private:
  /// Calls body(dz, index into the plane z + dz, coefficient) for the entries of a row that are not zero; those are
  /// inside the grid.
  template <typename Body>
  void forEachEntry(const PlaneRows<Real>& plane, std::size_t row, const Body& body) const
  {
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
          if (const Real c = plane.coefficients[27 * row + static_cast<std::size_t>(neighbourIndex(dx, dy, dz))];
              c != 0)
            body(dz, plane.voxels[row] + dx + std::int64_t{size_.x} * dy, c);
  }

  bool isAtEdge(std::int32_t voxel) const
  {
    const int x = voxel % size_.x, y = voxel / size_.x;
    return x == 0 || y == 0 || x + 1 == size_.x || y + 1 == size_.y;
  }

  /// Calls body(cell, sample, voxel of the plane, corner) for the corners of all samples' cells that are in plane z.
  template <typename Body>
  void forEachCorner(int z, const std::vector<std::size_t>& planeBegins, const Body& body) const
  {
    const int lastLayer = static_cast<int>(planeBegins.size()) - 2;
    for (int layer = std::max(z - 1, 0); layer <= std::min(z, lastLayer); ++layer)
      for (std::size_t s = planeBegins[static_cast<std::size_t>(layer)];
           s < planeBegins[static_cast<std::size_t>(layer) + 1]; ++s) {
        const Cell cell(samples_[s].position, size_);
        for (int corner = 4 * (z - layer); corner < 4 * (z - layer) + 4; ++corner)
          if (cell.has(corner))
            body(cell, samples_[s],
                 static_cast<std::int32_t>(cell.x.lower + (corner & 1) + size_.x * (cell.y.lower + (corner >> 1 & 1))),
                 corner);
      }
  }

  /// \param rowOf scratch, one per voxel of a plane
  void assemblePlane(int z, const std::vector<std::size_t>& planeBegins, double unit, std::vector<std::int32_t>& rowOf)
  {
    PlaneRows<Real>& plane = planes_[static_cast<std::size_t>(z)];
    constexpr std::int32_t none = -1;
    std::fill(rowOf.begin(), rowOf.end(), none);
    forEachCorner(z, planeBegins, [&](const Cell&, const PointSample&, std::int32_t voxel, int) {
      rowOf[static_cast<std::size_t>(voxel)] = 0;
    });
    for (const bool atEdge : {false, true}) {
      for (std::size_t voxel = 0; voxel < rowOf.size(); ++voxel)
        if (rowOf[voxel] != none && isAtEdge(static_cast<std::int32_t>(voxel)) == atEdge) {
          rowOf[voxel] = static_cast<std::int32_t>(plane.voxels.size());
          plane.voxels.push_back(static_cast<std::int32_t>(voxel));
        }
      if (!atEdge)
        plane.inner = plane.voxels.size();
    }
    plane.coefficients.assign(27 * plane.voxels.size(), 0);

    const std::int64_t first = size_.planeCount() * z;
    forEachCorner(z, planeBegins, [&](const Cell& cell, const PointSample& sample, std::int32_t voxel, int corner) {
      Real* row = plane.coefficients.data() + 27 * static_cast<std::size_t>(rowOf[static_cast<std::size_t>(voxel)]);
      const double value = weights_.value * sample.weight * cell.value(corner);
      const Eigen::Vector3d gradient = weights_.gradient * sample.weight * cell.gradient(corner);
      for (int other = 0; other < 8; ++other)
        if (cell.has(other)) {
          const auto step = [&](int axis) { return (other >> axis & 1) - (corner >> axis & 1); };
          row[neighbourIndex(step(0), step(1), step(2))] +=
              static_cast<Real>(value * cell.value(other) + gradient.dot(cell.gradient(other)));
        }
      rightHandSide_[static_cast<std::size_t>(first + voxel)] +=
          static_cast<Real>(unit * gradient.dot(sample.normal.template cast<double>()));
    });
    for (std::size_t row = 0; row < plane.voxels.size(); ++row)
      diagonal_[static_cast<std::size_t>(first + plane.voxels[row])] =
          plane.coefficients[27 * row + static_cast<std::size_t>(neighbourIndex(0, 0, 0))];
  }

  /// Largest eigenvalue of diag(C)⁻¹ C by power iteration, with a margin for what it has not found yet. It is at most
  /// 8, the number of voxels in a cell.
  Real estimateSpectralBound(Execution& execution) const;

  GridSize size_;
  std::vector<PointSample> samples_; ///< by planes of cells
  PointWeights weights_;
  std::vector<PlaneRows<Real>> planes_;
  std::vector<Real> rightHandSide_, diagonal_;
  Real spectralBound_ = 8;
};

template <typename Real>
Real PointDataTerm<Real>::estimateSpectralBound(Execution& execution) const
{
  constexpr int steps = 12;
  constexpr double margin = 1.1, limit = 8;
  const std::int64_t planeCount = size_.planeCount();
  std::vector<Real> x(diagonal_.size(), 0), product(diagonal_.size());
  for (std::size_t i = 0; i < x.size(); ++i) // uneven, so that no eigenvector is missed
    x[i] = diagonal_[i] > 0 ? Real(1) + Real(i * 2654435761u % 1024) / 512 : Real(0);
  double eigenvalue = 0;
  for (int step = 0; step < steps; ++step) {
    std::vector<double> quadratic(planes_.size(), 0), norm(planes_.size(), 0);
    execution.forRange(size_.z, grainPlanes, [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t z = begin; z < end; ++z) {
        const auto plane = [&](std::int64_t p) {
          return x.data() + planeCount * std::clamp<std::int64_t>(p, 0, size_.z - 1);
        };
        Real* y = product.data() + planeCount * z;
        std::fill_n(y, planeCount, Real(0));
        addPlaneProduct(static_cast<int>(z), plane(z - 1), plane(z), plane(z + 1), y);
        const auto part = static_cast<std::size_t>(z);
        for (const std::int32_t voxel : planes_[part].voxels) {
          const double d = static_cast<double>(diagonal_[static_cast<std::size_t>(planeCount * z + voxel)]);
          const double before = static_cast<double>(plane(z)[voxel]), after = static_cast<double>(y[voxel]);
          quadratic[part] += before * after;
          norm[part] += d * before * before;
          y[voxel] = d > 0 ? static_cast<Real>(after / d) : Real(0);
        }
      }
    });
    const double total = std::accumulate(norm.begin(), norm.end(), 0.);
    if (!(total > 0))
      return static_cast<Real>(limit);
    eigenvalue = std::accumulate(quadratic.begin(), quadratic.end(), 0.) / total;
    x.swap(product);
  }
  return static_cast<Real>(std::min(margin * eigenvalue, limit));
}

} // namespace

std::vector<PointSample> toSamples(const OrientedPoints& points, const Lattice& lattice, float spacing,
                                   Execution& execution)
{
  std::vector<PointSample> samples(points.size());
  forSamples(samples.size(), execution, [&](std::size_t i) {
    const float mass = points.confidence(i) * (points.spacings.empty() ? 1 : relativeArea(points.spacings[i], spacing));
    samples[i] = {lattice.toVoxels(points.positions[i]).cast<float>(), points.normals[i], mass};
  });
  return samples;
}

std::vector<PointSample> merge(const std::vector<PointSample>& samples, float side, Execution& execution)
{
  const CubeOrder cubes(samples, side, execution);
  const SortKeys& keys = cubes.keys;
  const auto isFirst = [&](std::size_t n) { return n == 0 || keys[n] != keys[n - 1]; };
  // Where the merged samples of each piece of work begin: those whose cube begins in it.
  const std::size_t pieces = (samples.size() + sampleGrain - 1) / sampleGrain;
  std::vector<std::size_t> begins(pieces + 1, 0);
  const auto forPieces = [&](const auto& body) {
    execution.forRange(static_cast<std::int64_t>(samples.size()), sampleGrain,
                       [&](std::int64_t begin, std::int64_t end) {
                         body(static_cast<std::size_t>(begin) / sampleGrain, static_cast<std::size_t>(begin),
                              static_cast<std::size_t>(end));
                       });
  };
  forPieces([&](std::size_t piece, std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      begins[piece + 1] += isFirst(n) ? 1 : 0;
  });
  std::partial_sum(begins.begin(), begins.end(), begins.begin());

  std::vector<PointSample> merged(begins.back());
  forPieces([&](std::size_t piece, std::size_t begin, std::size_t end) {
    std::size_t out = begins[piece];
    for (std::size_t n = begin; n < end; ++n) {
      if (!isFirst(n))
        continue;
      const PointSample& first = samples[cubes.order[n]];
      if (n + 1 == keys.size() || keys[n + 1] != keys[n]) {
        merged[out++] = first;
        continue;
      }
      SampleMean mean;
      for (std::size_t m = n; m < keys.size() && keys[m] == keys[n]; ++m)
        mean.add(samples[cubes.order[m]]);
      merged[out] = mean.sample();
      // Rounding must not move the mean into the next cube.
      const Eigen::Array3f lower = side * cubeOf(first, side).cast<float>();
      for (int axis = 0; axis < 3; ++axis)
        merged[out].position[axis] =
            std::clamp(merged[out].position[axis], lower[axis], std::nextafter(lower[axis] + side, lower[axis]));
      ++out;
    }
  });
  return merged;
}

std::vector<PointSample> sortedByCells(const std::vector<PointSample>& samples, Execution& execution)
{
  const std::vector<std::uint32_t> order = CubeOrder(samples, 1, execution).order;
  std::vector<PointSample> sorted(samples.size());
  forSamples(samples.size(), execution, [&](std::size_t n) { sorted[n] = samples[order[n]]; });
  return sorted;
}

PointWeights pointWeights(Prior prior, double smoothing, double spacing, double voxelSize, double gradientWeight)
{
  const double pointsPerFace = std::pow(voxelSize / spacing, 2) / 4;
  const double tau = pointsPerFace * std::pow(smoothing / voxelSize, 2 * order(prior) - 1);
  return {1 / tau, gradientWeight * std::pow(smoothing / voxelSize, 2) / tau};
}

template <typename Real>
std::unique_ptr<DataTerm<Real>> makePointDataTerm(GridSize size, std::vector<PointSample> samples,
                                                  const PointWeights& weights, double unit, Execution& execution)
{
  return std::make_unique<PointDataTerm<Real>>(size, std::move(samples), weights, unit, execution);
}

#define MRF_INSTANTIATE(Real)                                                                                          \
  template std::unique_ptr<DataTerm<Real>> makePointDataTerm(GridSize, std::vector<PointSample>, const PointWeights&,  \
                                                             double, Execution&);

MRF_INSTANTIATE(float)
MRF_INSTANTIATE(double)
#undef MRF_INSTANTIATE

} // namespace mrf
} // namespace pcl

#include <pcl/surface/mrf/distance_field.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace pcl {
namespace mrf {
namespace {

/// The cell around a position and the weights of its 8 voxels.
struct Cell {
  int i, j, k;
  float u, v, w;

  Cell(const Lattice& lattice, const Eigen::Vector3f& position)
  {
    const Eigen::Vector3d x = lattice.toVoxels(position);
    place(x.x(), lattice.size.x, i, u);
    place(x.y(), lattice.size.y, j, v);
    place(x.z(), lattice.size.z, k, w);
  }

  static void place(double coordinate, int size, int& index, float& fraction)
  {
    const double clamped = std::clamp(coordinate, 0.0, static_cast<double>(size - 1));
    index = std::min(static_cast<int>(clamped), size - 2);
    fraction = static_cast<float>(clamped - index);
  }

  /// Trilinear interpolation of `value(i, j, k)`.
  template <typename Value, typename Function>
  Value interpolate(const Function& value) const
  {
    const auto alongX = [&](int y, int z) -> Value { return (1 - u) * value(i, y, z) + u * value(i + 1, y, z); };
    const auto inPlane = [&](int z) -> Value { return (1 - v) * alongX(j, z) + v * alongX(j + 1, z); };
    return (1 - w) * inPlane(k) + w * inPlane(k + 1);
  }
};

} // namespace

DistanceField::DistanceField(const Lattice& lattice, std::vector<float> distances, std::vector<float> confidences)
    : lattice_(lattice), distances_(std::move(distances)), confidences_(std::move(confidences))
{
  const auto count = static_cast<std::size_t>(lattice_.size.count());
  if (distances_.size() != count || (!confidences_.empty() && confidences_.size() != count) ||
      std::min({lattice_.size.x, lattice_.size.y, lattice_.size.z}) < 2)
    throw std::invalid_argument(
        "DistanceField: needs at least 2 voxels along each axis and one value of each kind per voxel");
}

float DistanceField::sampleDistance(const Eigen::Vector3f& position) const
{
  return Cell(lattice_, position).interpolate<float>([&](int i, int j, int k) { return distance(i, j, k); });
}

Eigen::Vector3f DistanceField::sampleGradient(const Eigen::Vector3f& position) const
{
  const GridSize size = lattice_.size;
  const float inverse = static_cast<float>(1 / lattice_.spacing);
  // One-sided at the border: the divisor is the number of voxel sides between the two samples.
  const auto difference = [&](int lower, int upper, float below, float above) {
    return (above - below) * inverse / static_cast<float>(upper - lower);
  };
  const auto gradient = [&](int i, int j, int k) -> Eigen::Vector3f {
    const int i0 = std::max(i - 1, 0), i1 = std::min(i + 1, size.x - 1);
    const int j0 = std::max(j - 1, 0), j1 = std::min(j + 1, size.y - 1);
    const int k0 = std::max(k - 1, 0), k1 = std::min(k + 1, size.z - 1);
    return {difference(i0, i1, distance(i0, j, k), distance(i1, j, k)),
            difference(j0, j1, distance(i, j0, k), distance(i, j1, k)),
            difference(k0, k1, distance(i, j, k0), distance(i, j, k1))};
  };
  return Cell(lattice_, position).interpolate<Eigen::Vector3f>(gradient);
}

} // namespace mrf
} // namespace pcl

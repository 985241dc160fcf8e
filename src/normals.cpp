#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/normals.h>

#include <pcl/common/eigen.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace pcl {
namespace mrf {
namespace {

/// Neighbourhoods of fewer points, the point itself included, are extended to so many.
constexpr int fewestNeighbours = 12;

/// Neighbours lie on a line if the second eigenvalue is at most this share of the first, that is, if they are 10⁴
/// times as long as wide: about what rounding to single precision makes of a line that is short within its cloud.
constexpr double collinear = 1e-8;

struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(); ///< zero if the neighbours do not span a plane
  double thirdShare = 0;
  double distance = 0;
};

/// What pcl::NormalEstimation does per point, with PCL's closed form of the eigenvalues, but in double precision: its
/// own single precision loses the middle eigenvalue, which tells lines from planes, and small third ones.
Plane fitPlane(const std::vector<Eigen::Vector3f>& positions, const std::uint32_t* neighbours, std::size_t count,
               const Eigen::Vector3f& position)
{
  Plane plane;
  if (count < 3)
    return plane;
  // Relative to the point itself, so that nothing is lost far from the origin.
  const Eigen::Vector3d centre = position.cast<double>();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const Eigen::Vector3d p = positions[neighbours[n]].cast<double>() - centre;
    sum += p;
    xx += p.x() * p.x();
    xy += p.x() * p.y();
    xz += p.x() * p.z();
    yy += p.y() * p.y();
    yz += p.y() * p.z();
    zz += p.z() * p.z();
  }
  const double share = 1 / static_cast<double>(count);
  const Eigen::Vector3d mean = share * sum;
  Eigen::Matrix3d covariance;
  covariance << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  covariance = share * covariance - mean * mean.transpose();
  const double scale = covariance.trace();
  if (!(scale > 0))
    return plane;
  // Of unit trace, because PCL's closed-form roots compare with absolute limits.
  covariance /= scale;
  Eigen::Vector3d values;
  eigen33(covariance, values);
  if (!(values[1] > collinear * values[2]))
    return plane;
  Eigen::Vector3d normal;
  computeCorrespondingEigenVector(covariance, values[0], normal);
  if (!normal.allFinite())
    return plane;
  plane.normal = normal;
  plane.thirdShare = std::max(values[0], 0.0);
  plane.distance = std::abs(normal.dot(mean));
  return plane;
}

template <typename Value>
[[noreturn]] void refuse(const char* name, Value value, const char* range)
{
  std::ostringstream text;
  text << "normals." << name << " = " << value << " is outside its range " << range;
  throw InvalidOption(text.str());
}

} // namespace

void validate(const NormalOptions& options)
{
  if (!(options.radius >= 0) || !std::isfinite(options.radius))
    refuse("radius", options.radius, ">= 0 (0 = 2.5 times the sampling distance)");
  if (!(options.maxThirdEigenvalue > 0 && options.maxThirdEigenvalue <= 1.0f / 3))
    refuse("maxThirdEigenvalue", options.maxThirdEigenvalue, "(0, 1/3]");
  if (!(options.maxPlaneDistance >= 0) || !std::isfinite(options.maxPlaneDistance))
    refuse("maxPlaneDistance", options.maxPlaneDistance, ">= 0 (0 = the sampling distance)");
}

NormalEstimates estimateNormals(const PointSet& points, const NeighbourSearch& search, float spacing,
                                const NormalOptions& options, Execution& execution)
{
  validate(options);
  const float radius = options.radius > 0 ? options.radius : 2.5f * spacing;
  const float maxPlaneDistance = options.maxPlaneDistance > 0 ? options.maxPlaneDistance : spacing;
  NormalEstimates estimates;
  estimates.normals.assign(points.size(), Eigen::Vector3f::Zero());
  estimates.thirdEigenvalueShare.assign(points.size(), 0);
  estimates.planeDistances.assign(points.size(), 0);
  estimates.isNoise.assign(points.size(), 0);
  // In this order because most neighbourhoods of unevenly sampled clouds are small, and then one query is enough.
  search.forEachPosition(
      points.positions, fewestNeighbours, NeighbourSearch::Answer::indicesAndDistances, execution,
      [&](const NeighbourBatch& batch) {
        Neighbours found;
        for (std::size_t q = 0; q < batch.size; ++q) {
          const std::size_t i = batch.positions[q];
          const Eigen::Vector3f& position = points.positions[i];
          const float* squared = batch.squaredDistances + q * batch.k;
          Plane plane;
          if (squared[batch.k - 1] < radius * radius) {
            const int number = search.within(position, radius, found);
            const std::vector<std::uint32_t> indices(found.indices.begin(), found.indices.begin() + number);
            plane = fitPlane(points.positions, indices.data(), indices.size(), position);
          } else {
            const auto number = static_cast<std::size_t>(
                std::find_if(squared, squared + batch.k, [](float s) { return !std::isfinite(s); }) - squared);
            plane = fitPlane(points.positions, batch.indices + q * batch.k, number, position);
          }
          estimates.normals[i] = plane.normal.cast<float>();
          estimates.thirdEigenvalueShare[i] = static_cast<float>(plane.thirdShare);
          estimates.planeDistances[i] = static_cast<float>(plane.distance);
          if (options.noiseCriteria)
            estimates.isNoise[i] =
                plane.thirdShare > options.maxThirdEigenvalue || plane.distance > maxPlaneDistance ? 1 : 0;
        }
      });
  return estimates;
}

} // namespace mrf
} // namespace pcl

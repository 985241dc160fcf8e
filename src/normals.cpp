#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/normals.h>

#include <pcl/common/centroid.h>
#include <pcl/common/eigen.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace pcl {
namespace mrf {
namespace {

/// Points per piece of parallel work: a few milliseconds of queries.
constexpr std::int64_t grain = 512;

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

/// What pcl::NormalEstimation does per point, from the same functions of PCL, but in double precision: its own single
/// precision loses the middle eigenvalue, which tells lines from planes, and small third ones.
Plane fitPlane(const PointCloud<PointXYZ>& cloud, const Indices& neighbours, const Eigen::Vector3f& position)
{
  Plane plane;
  Eigen::Matrix3d covariance;
  Eigen::Vector4d centroid;
  if (neighbours.size() < 3 || computeMeanAndCovarianceMatrix(cloud, neighbours, covariance, centroid) == 0)
    return plane;
  const double scale = covariance.trace();
  if (!(scale > 0))
    return plane;
  // Of unit trace, because PCL's closed-form roots compare with absolute limits.
  covariance /= scale;
  Eigen::Vector3d values;
  eigen33(covariance, values);
  if (!(values[1] > collinear * values[2]))
    return plane;
  double smallest = 0;
  Eigen::Vector3d normal;
  eigen33(covariance, smallest, normal);
  if (!normal.allFinite())
    return plane;
  plane.normal = normal;
  plane.thirdShare = std::max(smallest, 0.0);
  plane.distance = std::abs(normal.dot(position.cast<double>() - centroid.head<3>()));
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
  PointCloud<PointXYZ> cloud;
  cloud.reserve(points.size());
  for (const Eigen::Vector3f& position : points.positions)
    cloud.push_back(PointXYZ(position.x(), position.y(), position.z()));

  NormalEstimates estimates;
  estimates.normals.assign(points.size(), Eigen::Vector3f::Zero());
  estimates.thirdEigenvalueShare.assign(points.size(), 0);
  estimates.planeDistances.assign(points.size(), 0);
  estimates.isNoise.assign(points.size(), 0);
  execution.forRange(static_cast<std::int64_t>(points.size()), grain, [&](std::int64_t begin, std::int64_t end) {
    Neighbours found;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const Eigen::Vector3f& position = points.positions[i];
      // In this order because most neighbourhoods of unevenly sampled clouds are small, and then one query is enough.
      const int number = search.nearest(position, fewestNeighbours, found);
      if (number == fewestNeighbours && found.squaredDistances.back() < radius * radius)
        search.within(position, radius, found);
      const Plane plane = fitPlane(cloud, found.indices, position);
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

// SPDX-License-Identifier: BSD-3-Clause
#include "rotation.h"

#include "evaluate/surface_distance.h"
#include "evaluate/surface_samples.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>

namespace mrf_apps {

Eigen::Matrix3d rotationAbout(const Eigen::Vector3d& axis, double angle)
{
  return Eigen::AngleAxisd(angle * M_PI / 180, axis.normalized()).toRotationMatrix();
}

Statistics differenceWithin(const SurfaceMesh& a, const SurfaceMesh& b,
                            const std::function<bool(const Eigen::Vector3d&)>& isInside, std::int64_t samples,
                            std::uint64_t seed, pcl::mrf::Execution& execution)
{
  const auto samplesInside = [&](const SurfaceMesh& mesh) {
    std::vector<Eigen::Vector3d> places = sampleSurface(mesh, samples, seed).positions;
    places.erase(std::remove_if(places.begin(), places.end(), [&](const auto& place) { return !isInside(place); }),
                 places.end());
    return places;
  };
  const std::vector<Eigen::Vector3d> onA = samplesInside(a), onB = samplesInside(b);
  if (onA.empty() != onB.empty()) {
    const double infinity = std::numeric_limits<double>::infinity();
    return {static_cast<std::int64_t>(onA.size() + onB.size()), infinity, infinity, infinity, infinity, infinity};
  }
  std::vector<double> distances = SurfaceDistance(b).distances(onA, execution);
  const std::vector<double> back = SurfaceDistance(a).distances(onB, execution);
  distances.insert(distances.end(), back.begin(), back.end());
  return summarize(std::move(distances));
}

void keepWithin(double radius, SurfaceMesh& mesh)
{
  const auto isOutside = [&](const std::array<std::int32_t, 3>& triangle) {
    return std::any_of(triangle.begin(), triangle.end(),
                       [&](std::int32_t v) { return mesh.vertices[static_cast<std::size_t>(v)].norm() > radius; });
  };
  mesh.triangles.erase(std::remove_if(mesh.triangles.begin(), mesh.triangles.end(), isOutside), mesh.triangles.end());
}

} // namespace mrf_apps

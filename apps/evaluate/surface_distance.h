// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Exact distances from points to the surface of a triangle mesh.
#pragma once

#include "support/surface_mesh.h"

#include <pcl/surface/mrf/execution.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace mrf_apps {

/// The place of a surface that is closest to a point.
struct ClosestPlace {
  double distance = 0;       ///< cloud's unit
  std::int32_t triangle = 0; ///< of the mesh
};

/// Point-to-triangle distances through VTK's static cell locator, in double precision.
///
/// The surface is made of the triangles that have an area: one with a repeated vertex, collinear corners or a vertex
/// that is not finite adds nothing to it.
class SurfaceDistance {
public:
  /// Cost: linear in the triangles. \throw pcl::mrf::InvalidInput if no triangle has an area
  explicit SurfaceDistance(const SurfaceMesh& mesh);
  ~SurfaceDistance();

  /// The closest place for each point. \pre the points are finite
  /// The result does not depend on the number of threads.
  std::vector<ClosestPlace> closest(const std::vector<Eigen::Vector3d>& points, pcl::mrf::Execution& execution) const;

  /// The distances alone.
  std::vector<double> distances(const std::vector<Eigen::Vector3d>& points, pcl::mrf::Execution& execution) const;

private:
  struct Locator;
  std::unique_ptr<Locator> locator_;
};

} // namespace mrf_apps

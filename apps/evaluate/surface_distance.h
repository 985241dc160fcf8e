// SPDX-License-Identifier: BSD-3-Clause
/// The surface of a triangle mesh: exact distances to it, and points spread over it.
#pragma once

#include "support/surface_mesh.h"

#include <pcl/surface/mrf/execution.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace mrf_apps {

/// Half the cross product of two edges: as long as the triangle's area, along its normal. Zero if a vertex is not
/// finite.
Eigen::Vector3d areaVector(const SurfaceMesh& mesh, std::size_t triangle);

/// Sum of the triangles' areas, cloud's unit squared.
double surfaceArea(const SurfaceMesh& mesh);

/// The place on a surface that is closest to a point.
struct ClosestPlace {
  double distance = 0;       ///< cloud's unit
  std::int32_t triangle = 0; ///< of the mesh
};

std::vector<double> distancesOf(const std::vector<ClosestPlace>& places);

/// Point-to-triangle distances through VTK's static cell locator, in double precision.
///
/// Only triangles with an area count: no repeated vertices, collinear corners or vertices that are not finite.
class SurfaceDistance {
public:
  /// Cost: linear in the triangles. \throw pcl::mrf::InvalidInput if no triangle has an area
  explicit SurfaceDistance(const SurfaceMesh& mesh);

  /// The closest place for each point. \pre the points are finite
  /// The result does not depend on the number of threads.
  std::vector<ClosestPlace> closest(const std::vector<Eigen::Vector3d>& points, pcl::mrf::Execution& execution) const;

private:
  struct Locator;
  std::shared_ptr<Locator> locator_;
};

struct SurfaceSamples {
  std::vector<Eigen::Vector3d> positions;
  std::vector<std::int32_t> triangles; ///< that each position lies on
};

/// Random points, uniform over the area. The area, summed over the triangles in their order, is divided into `count`
/// equal strata with one point each. So the error of a measured share of the area comes from the outline of the part
/// alone and is smaller than 1/√count. The same seed gives the same points. \pre a triangle has an area
SurfaceSamples sampleSurface(const SurfaceMesh& mesh, std::int64_t count, std::uint64_t seed);

} // namespace mrf_apps

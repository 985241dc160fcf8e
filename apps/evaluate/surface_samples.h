// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Points spread over the surface of a triangle mesh, each standing for the same area.
#pragma once

#include "support/surface_mesh.h"

#include <cstdint>
#include <vector>

namespace mrf_apps {

/// Half the cross product of two edges: as long as the triangle's area, along its normal. Zero if a vertex is not
/// finite.
Eigen::Vector3d areaVector(const SurfaceMesh& mesh, std::size_t triangle);

/// True if a triangle has one: the others are no surface.
bool hasArea(const SurfaceMesh& mesh);

/// Sum of the triangles' areas, cloud's unit squared.
double surfaceArea(const SurfaceMesh& mesh);

struct SurfaceSamples {
  std::vector<Eigen::Vector3d> positions;
  std::vector<std::int32_t> triangles; ///< that each position lies on
};

/// Random points, uniform over the area, one in each of `count` equal strata of the area summed over the triangles in
/// their order: shares of the area are then known to about the outline of the parts instead of to 1/√count.
/// The same seed gives the same points.
/// \throw pcl::mrf::InvalidInput if no triangle has an area
SurfaceSamples sampleSurface(const SurfaceMesh& mesh, std::int64_t count, std::uint64_t seed);

} // namespace mrf_apps

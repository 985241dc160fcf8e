// SPDX-License-Identifier: BSD-3-Clause
/// Morphological closing on a mesh: what lies between parts of a surface, and what lies outside of it.
#pragma once

#include "mesh/mesh_topology.h"

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// A vertex where a surface ends, and its distance from that, ≥ 0.
struct RimVertex {
  std::int32_t vertex;
  float distance;
};

/// Closes a surface by a radius: dilated by it along the sheet around the surface and eroded by it again, it has filled
/// what is narrower than twice the radius (gaps, holes, bays) and has not grown elsewhere.
///
///     surface |<- gap < 2 r ->| surface |<- r ->:  beyond: outside
///             |    filled     |         | given back
///
/// At the mesh's boundary the sheet is taken to go on as it is, so that it does not matter where it is cut off.
/// \param sheet corners of the triangles that are not of the surface \param rim where it borders on the surface
/// \param radius > 0 \param isOnBoundary one flag per vertex: the mesh ends there
/// \return one flag per vertex of the mesh, set on those of the sheet that are filled
/// Lengths are measured along edges. Serial.
std::vector<std::uint8_t> close(const TriangleMesh& mesh, const VertexCorners& sheet, const std::vector<RimVertex>& rim,
                                float radius, const std::vector<std::uint8_t>& isOnBoundary);

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// Morphological closing on a mesh: tells what lies between parts of a surface from what lies outside of it.
#pragma once

#include "mesh/mesh_topology.h"

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// A vertex where a surface ends, and its distance from the surface, ≥ 0.
struct RimVertex {
  std::int32_t vertex;
  float distance;
};

/// Closes a surface by a radius r: dilates it by r along the sheet around it, then erodes it by r. That fills gaps,
/// holes and bays narrower than 2 r, and leaves the surface as it is elsewhere.
///
///     surface |<- gap < 2 r ->| surface |<- r ->:  beyond: outside
///             |    filled     |         | given back
///
/// The sheet is taken to go on beyond the mesh's boundary, so that it does not matter where the mesh was cut off.
/// \param sheet corners of the triangles outside of the surface \param rim vertices where these touch the surface
/// \param radius > 0 \param isOnBoundary one flag per vertex: the mesh ends there
/// \return one flag per vertex of the mesh, set on those of the sheet that are filled
/// Lengths are measured along edges. Serial.
std::vector<std::uint8_t> close(const TriangleMesh& mesh, const VertexCorners& sheet, const std::vector<RimVertex>& rim,
                                float radius, const std::vector<std::uint8_t>& isOnBoundary);

} // namespace pcl::mrf

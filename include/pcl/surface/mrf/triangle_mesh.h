// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The mesh type shared by polygonizer, remesher, trimming and the facade.
#pragma once

#include <pcl/surface/mrf/export.h>

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

using Triangle = std::array<std::int32_t, 3>;

/// An indexed triangle mesh in the recentered frame. Triangles are counter-clockwise seen from outside (d > 0).
/// Optional per-vertex arrays are either empty or as long as `vertices`.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Triangle> triangles;
  std::vector<Eigen::Vector3f> normals; ///< unit, outward: the normalized gradient of the field
  std::vector<float> confidences;       ///< α at the vertex, 0..1
  /// Standard deviation of the surface along its normal, cloud's unit; see uncertainty.h. Empty: not asked for.
  std::vector<float> sigmas;
  std::vector<std::uint8_t> calibrated; ///< 1, or 0 where sigma is an extrapolation; with sigmas only
};

/// Keeps the triangles whose flag is set and the vertices they use, in their order, with all per-vertex arrays.
/// \pre keep.size() == mesh.triangles.size()
PCL_MRF_EXPORT TriangleMesh select(const TriangleMesh& mesh, const std::vector<std::uint8_t>& keep);

/// The mesh with each vertex moved along its normal; all but the vertices stays as it is, the normals too.
/// \param distances one per vertex, cloud's unit \pre the mesh has normals
PCL_MRF_EXPORT TriangleMesh displaced(TriangleMesh mesh, const std::vector<float>& distances);

} // namespace mrf
} // namespace pcl

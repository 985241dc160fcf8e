// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Checks and statistics of triangle meshes: validity, topology, triangle quality.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <array>
#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// 2 · inradius / circumradius of a triangle: 1 for equilateral, 0 for degenerate.
PCL_MRF_EXPORT double triangleQuality(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);

struct MeshStatistics {
  std::int64_t vertices = 0;
  std::int64_t triangles = 0;
  std::int64_t edges = 0;
  std::int64_t components = 0; ///< connected over edges
  std::int64_t boundaryEdges = 0;
  std::int64_t boundaryLoops = 0;
  std::int64_t nonManifoldEdges = 0;    ///< more than two triangles, or two that disagree on the orientation
  std::int64_t nonManifoldVertices = 0; ///< triangles around the vertex do not form one fan
  std::int64_t degenerateTriangles = 0; ///< repeated or missing vertex, not finite, or quality below 1e-6
  std::int64_t unusedVertices = 0;
  std::int64_t eulerCharacteristic = 0; ///< V − E + F, V without unused vertices
  double area = 0;                      ///< cloud's unit squared
  double volume = 0;                    ///< signed, by the divergence theorem; meaningful for closed meshes
  double meanQuality = 0;               ///< of triangleQuality over all triangles
  double minQuality = 0;
  double meanEdge = 0, minEdge = 0, maxEdge = 0; ///< cloud's unit
  double areaDeviation = 0;                      ///< standard deviation of triangle area / mean area
  std::array<std::int64_t, 16> valences{};       ///< vertices by number of edges; the last bin collects ≥ 15

  bool closed() const { return boundaryEdges == 0; }
  bool manifold() const { return nonManifoldEdges == 0 && nonManifoldVertices == 0; }
  /// Share of vertices with six edges.
  double regularShare() const
  {
    return vertices > 0 ? static_cast<double>(valences[6]) / static_cast<double>(vertices) : 0;
  }
};

/// Computes all statistics, of any mesh.
///
/// Triangles with a repeated vertex or an index out of range count as degenerate and are left out of the topology
/// (edges, components, Euler characteristic); areas, volumes and lengths that are not finite are left out of the sums.
/// \throw ResourceLimit for more than 2³¹/3 triangles
/// Cost: linear in the number of triangles for bounded valences.
/// The result does not depend on the number of threads.
PCL_MRF_EXPORT MeshStatistics measure(const TriangleMesh& mesh, Execution& execution);

/// The same on the calling thread.
PCL_MRF_EXPORT MeshStatistics measure(const TriangleMesh& mesh);

/// Component of each triangle, connected over shared edges; components are numbered by their first triangle;
/// −1 for triangles with a repeated vertex or an index out of range.
/// \return number of components
PCL_MRF_EXPORT std::int32_t connectedComponents(const TriangleMesh& mesh,
                                                std::vector<std::int32_t>& componentOfTriangle);

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
/// Makes meshes, and compares their statistics.
#pragma once

#include "mesh/polygonizer.h"

#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

namespace meshes {

inline pcl::mrf::TriangleMesh zeroLevel(const pcl::mrf::DistanceField& field, int threads = 1)
{
  pcl::mrf::Execution execution(threads);
  return polygonize(field, execution);
}

/// First-order distances from the vertices of a field's zero level to the zero level of another field, in voxel sides.
inline std::vector<double> zeroLevelOffsets(const pcl::mrf::DistanceField& field, const pcl::mrf::DistanceField& other)
{
  std::vector<double> result;
  for (const Eigen::Vector3f& vertex : zeroLevel(field).vertices)
    result.push_back(std::abs(other.sampleDistance(vertex)) / std::max(other.sampleGradient(vertex).norm(), .3f) /
                     field.lattice().spacing);
  return result;
}

/// `other` is passed by value, so that a mesh may be appended to itself.
inline void append(pcl::mrf::TriangleMesh& mesh, pcl::mrf::TriangleMesh other,
                   const Eigen::Vector3f& shift = Eigen::Vector3f::Zero())
{
  const auto first = static_cast<std::int32_t>(mesh.vertices.size());
  for (const Eigen::Vector3f& p : other.vertices)
    mesh.vertices.push_back(p + shift);
  for (const pcl::mrf::Triangle& t : other.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

/// The triangles whose centroids fulfill a condition, with their vertices.
template <typename Condition>
pcl::mrf::TriangleMesh selectWhere(const pcl::mrf::TriangleMesh& mesh, const Condition& holds)
{
  std::vector<std::uint8_t> keep;
  for (const pcl::mrf::Triangle& t : mesh.triangles)
    keep.push_back(holds(((mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3).eval()) ? 1 : 0);
  return select(mesh, keep);
}

/// side × side unit squares in z = 0, of two triangles each; vertices row by row.
inline pcl::mrf::TriangleMesh squares(int side)
{
  pcl::mrf::TriangleMesh mesh;
  for (int j = 0; j <= side; ++j)
    for (int i = 0; i <= side; ++i)
      mesh.vertices.emplace_back(static_cast<float>(i), static_cast<float>(j), 0.f);
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const std::int32_t v = j * (side + 1) + i;
      mesh.triangles.push_back({v, v + 1, v + side + 2});
      mesh.triangles.push_back({v, v + side + 2, v + side + 1});
    }
  return mesh;
}

/// The edges with only one triangle, in its direction.
inline std::map<std::int32_t, std::int32_t> boundaryOf(const pcl::mrf::TriangleMesh& mesh)
{
  std::set<std::pair<std::int32_t, std::int32_t>> edges;
  for (const pcl::mrf::Triangle& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i)
      if (edges.erase({t[(i + 1) % 3], t[i]}) == 0)
        edges.insert({t[i], t[(i + 1) % 3]});
  return {edges.begin(), edges.end()};
}

inline double lengthOf(const pcl::mrf::TriangleMesh& mesh, const std::map<std::int32_t, std::int32_t>& border)
{
  double length = 0;
  for (const auto& edge : border)
    length += (mesh.vertices[edge.second] - mesh.vertices[edge.first]).norm();
  return length;
}

/// The corners of each triangle, rotated so that the smallest is first: independent of the numbers of the vertices.
inline std::vector<std::array<std::array<float, 3>, 3>> cornersOf(const pcl::mrf::TriangleMesh& mesh)
{
  std::vector<std::array<std::array<float, 3>, 3>> result;
  for (const pcl::mrf::Triangle& t : mesh.triangles) {
    std::array<std::array<float, 3>, 3> corners;
    for (std::size_t i = 0; i < 3; ++i)
      Eigen::Vector3f::Map(corners[i].data()) = mesh.vertices[t[i]];
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    result.push_back(corners);
  }
  return result;
}

/// Expects a manifold without degenerate triangles and without unused vertices.
inline void expectSound(const pcl::mrf::MeshStatistics& mesh)
{
  EXPECT_EQ(mesh.nonManifoldEdges, 0);
  EXPECT_EQ(mesh.nonManifoldVertices, 0);
  EXPECT_EQ(mesh.degenerateTriangles, 0);
  EXPECT_EQ(mesh.unusedVertices, 0);
}

/// Expects the same vertices and triangles, to the last bit.
inline void expectSame(const pcl::mrf::TriangleMesh& a, const pcl::mrf::TriangleMesh& b)
{
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
}

/// Expects all figures to be identical, to the last bit.
inline void expectSame(const pcl::mrf::MeshStatistics& a, const pcl::mrf::MeshStatistics& b)
{
  const auto figures = [](const pcl::mrf::MeshStatistics& s) {
    return std::tie(s.vertices, s.triangles, s.edges, s.components, s.boundaryEdges, s.boundaryLoops,
                    s.nonManifoldEdges, s.nonManifoldVertices, s.degenerateTriangles, s.unusedVertices,
                    s.eulerCharacteristic, s.area, s.volume, s.meanQuality, s.minQuality, s.meanEdge, s.minEdge,
                    s.maxEdge, s.areaDeviation, s.valences);
  };
  EXPECT_EQ(figures(a), figures(b));
}

} // namespace meshes

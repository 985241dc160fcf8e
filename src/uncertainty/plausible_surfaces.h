// SPDX-License-Identifier: BSD-3-Clause
/// Plausible surfaces: the mesh, moved by draws from the posterior as sigma allows, see src/method.md, "Error bars".
#pragma once

#include "uncertainty/uncertainty.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// The number of draws.
inline int numberOfDraws(const UncertaintyOptions& options)
{
  return std::max(options.samples, options.surfaces);
}

/// A triangle of a moved mesh, and its normals.
struct MovedTriangle {
  std::array<Eigen::Vector3d, 3> corners, normals;

  /// \param distances of all vertices along their normals
  MovedTriangle(const TriangleMesh& mesh, const std::vector<float>& distances, const Triangle& triangle)
  {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t v = triangle[c];
      normals[c] = mesh.normals[v].cast<double>();
      corners[c] = mesh.vertices[v].cast<double>() + static_cast<double>(distances[v]) * normals[c];
    }
  }

  double area() const { return (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm() / 2; }

  double volume() const { return corners[0].dot(corners[1].cross(corners[2])) / 6; }

  /// Mean height over the triangle of the paraboloid through its corners that is perpendicular to the normals there.
  /// The middle of an edge is as high as the arc whose ends have these normals; an edge stands for a third of the area.
  double meanBulge() const
  {
    double heights = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t next = (c + 1) % 3;
      heights += (corners[next] - corners[c]).dot(normals[next] - normals[c]) / 8;
    }
    return heights / 3;
  }
};

/// Half of the width of a 95 % interval, in standard deviations, by Student's t: 1.96 for many degrees of freedom.
double studentHalfWidth(double freedom);

/// For each piece, the vertices that are in its volume or nearest to it. \pre there are pieces
template <typename Piece>
std::vector<std::vector<std::int32_t>> verticesOf(const std::vector<Piece>& pieces,
                                                  const std::vector<Eigen::Vector3f>& vertices)
{
  std::vector<std::vector<std::int32_t>> result(pieces.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Eigen::Vector3f& at = vertices[v];
    const auto distanceTo = [&](const Piece& piece) {
      return (at - at.cwiseMax(piece.volume.lower).cwiseMin(piece.volume.upper)).squaredNorm();
    };
    const auto nearest = std::min_element(
        pieces.begin(), pieces.end(), [&](const Piece& a, const Piece& b) { return distanceTo(a) < distanceTo(b); });
    result[nearest - pieces.begin()].push_back(static_cast<std::int32_t>(v));
  }
  return result;
}

/// A mesh with normals and sigmas.
struct SampledMesh {
  const TriangleMesh& mesh;
  bool isClosed; ///< the mesh is closed: it has a volume
  bool isFitted; ///< triangles, not vertices, are on the surface in the mean, see RemesherOptions::fit
};

/// Measures the surface of each draw, and returns the first ones. \param offset UncertaintyReport::offset, a part of
/// sigma that all vertices of a draw share \param kept number of surfaces to return
/// \param shape receives the measurements \return distances along the normals, by surface and vertex
/// The result does not depend on the number of threads. Memory: a float per vertex, and one for each surface kept.
std::vector<std::vector<float>> samplePlausibleSurfaces(const std::vector<PieceDraws>& draws, double offset,
                                                        const SampledMesh& sampled, int kept, SampledShape& shape,
                                                        Execution& execution);

} // namespace pcl::mrf

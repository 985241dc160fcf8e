// SPDX-License-Identifier: BSD-3-Clause
/// The borders of an open mesh as smooth curves, along which the remesher may move border vertices.
#pragma once

#include "remesher/half_edge_mesh.h"

#include <Eigen/Core>

#include <cstdint>
#include <functional>
#include <vector>

namespace pcl::mrf {

/// The border loops of a mesh, smoothed.
///
/// A border that is cut along the triangles of voxel cells has teeth of a voxel's size. A few steps of averaging each
/// vertex with both neighbors remove the teeth and keep details longer than a few edges.
///
/// A place is an arc length that goes on from loop to loop; it grows in the direction of the border edges.
class BorderCurves {
public:
  BorderCurves() = default;

  /// Moves a position to the surface; \return false if it cannot
  using OnSurface = std::function<bool(Eigen::Vector3f&)>;

  /// \param next for each border vertex the next one on the border, −1 for other vertices
  /// \param maxShift max distance by which smoothing moves a vertex, cloud's unit
  /// \param places receives each vertex's place, −1 off the border; stays empty if there is no border
  BorderCurves(const std::vector<Eigen::Vector3f>& positions, const std::vector<std::int32_t>& next, float maxShift,
               const OnSurface& onSurface, std::vector<double>& places);

  /// The same for a half-edge mesh and its places.
  BorderCurves(HalfEdgeMesh& mesh, float maxShift, const OnSurface& onSurface)
      : BorderCurves(mesh.positions, mesh.nextOnBorders(), maxShift, onSurface, mesh.places)
  {}

  Eigen::Vector3f at(double place) const;

  /// The place at a share, 0..1, of the way from one place forward to another one of the same loop.
  double between(double from, double to, double share) const;

  /// The share, 0..1, of the way `from` → `to` at which a place of the same loop lies: the inverse of between().
  double share(double from, double place, double to) const;

  /// True if all nodes from one place forward to another one of its loop are within a distance of a segment.
  bool isNear(double from, double to, const Eigen::Vector3f& start, const Eigen::Vector3f& end, float distance) const;

  /// For Boost's archives.
  template <typename Archive>
  void serialize(Archive& archive, unsigned)
  {
    (void)(archive & firstNodes_ & nodes_ & starts_);
  }

private:
  struct Loop {
    std::size_t first, last; ///< nodes; the last one is at the first one's position
  };

  void addLoop(const std::vector<Eigen::Vector3f>& positions, const std::vector<std::int32_t>& loop, float maxShift,
               const OnSurface& onSurface, std::vector<double>& places);
  std::size_t nodeBefore(double place) const;
  Loop loopOf(double place) const;
  double lengthOn(const Loop& loop, double from, double to) const;

  std::vector<std::size_t> firstNodes_; ///< first node of each loop
  std::vector<Eigen::Vector3f> nodes_;
  std::vector<double> starts_; ///< place of each node, ascending
};

} // namespace pcl::mrf

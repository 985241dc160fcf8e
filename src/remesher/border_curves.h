// SPDX-License-Identifier: BSD-3-Clause
/// The borders of an open mesh as smooth curves, along which the remesher may move their vertices.
#pragma once

#include "remesher/half_edge_mesh.h"

#include <Eigen/Core>

#include <cstdint>
#include <functional>
#include <vector>

namespace pcl::mrf {

/// The border loops of a mesh, smoothed.
///
/// Where a surface is cut off along the triangles of voxel cells, its border has teeth of a voxel's size. A few steps
/// of averaging with both neighbors take them away and leave what is longer than a few edges.
///
/// A place is an arc length, counted on through all loops; it grows along the directed border edges.
class BorderCurves {
public:
  BorderCurves() = default;

  /// Moves a position to the surface; \return false if it cannot
  using OnSurface = std::function<bool(Eigen::Vector3f&)>;

  /// \param next of each vertex of the border the one that follows, −1 for the others
  /// \param maxShift of a border vertex by smoothing, cloud's unit
  /// \param places set, of vertices off the border to −1; stays empty if there is no border
  BorderCurves(const std::vector<Eigen::Vector3f>& positions, const std::vector<std::int32_t>& next, float maxShift,
               const OnSurface& onSurface, std::vector<double>& places);

  /// The same for a mesh and its places.
  BorderCurves(HalfEdgeMesh& mesh, float maxShift, const OnSurface& onSurface)
      : BorderCurves(mesh.positions, mesh.nextOnBorders(), maxShift, onSurface, mesh.places)
  {}

  bool empty() const { return nodes_.empty(); }

  Eigen::Vector3f at(double place) const;

  /// The place at a share of the way from one place on to another of the same loop, 0..1.
  double between(double from, double to, double share) const;

  /// How far along a place is on the way from one to another of its loop, 0..1: the reverse of between().
  double share(double from, double place, double to) const;

  /// True if the curve's nodes between two places of a loop, the second one ahead, are within a distance of a segment.
  bool isNear(double from, double to, const Eigen::Vector3f& start, const Eigen::Vector3f& end, float distance) const;

  /// For Boost's archives.
  template <typename Archive>
  void serialize(Archive& archive, unsigned)
  {
    (void)(archive & firstNodes_ & nodes_ & starts_);
  }

private:
  struct Loop {
    std::size_t first, last; ///< nodes; the last one is where the first is
  };

  void addLoop(const std::vector<Eigen::Vector3f>& positions, const std::vector<std::int32_t>& loop, float maxShift,
               const OnSurface& onSurface, std::vector<double>& places);
  std::size_t nodeBefore(double place) const;
  Loop loopOf(double place) const;
  double lengthOn(const Loop& loop, double from, double to) const;

  std::vector<std::size_t> firstNodes_; ///< of the loops
  std::vector<Eigen::Vector3f> nodes_;
  std::vector<double> starts_; ///< place of each node, ascending
};

} // namespace pcl::mrf

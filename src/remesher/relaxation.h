// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The pass of the remesher that moves vertices.
#pragma once

#include "remesher/intersection_watch.h"
#include "remesher/remeshed_surface.h"

#include <pcl/surface/mrf/execution.h>

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <vector>

namespace pcl {
namespace mrf {

/// Moves each vertex towards the centroid of its neighbors on the surface, and back where triangles come to intersect.
class Relaxation {
public:
  /// \param share of the tangential step that is taken, (0, 1]
  Relaxation(RemeshedSurface& surface, float share, Execution& execution);

  /// All steps are computed from the same state, in parallel; they are taken one by one, each against the state it
  /// meets. Vertices of a range whose neighbors all belong to it move while other ranges do the same; the rest move
  /// after them.
  void moveAll();

  /// Takes vertices of intersecting triangles back to where they were, and what would be a bad triangle then as well,
  /// until no triangles intersect. \return the corners of those that do and did not move
  std::vector<std::int32_t> takeBackWhatIntersects(const IntersectionWatch& watch);

private:
  struct Step {
    Eigen::Vector3f tangential = Eigen::Vector3f::Zero();
    std::optional<Corner> reached; ///< by the whole step, then to the zero level; on the border not in use
    bool isSettled = false;        ///< the step is not worth the way
  };

  std::vector<float> areas() const;
  void computeSteps();
  void moveInRanges();
  void moveWaiting();
  bool move(std::int32_t v);
  bool moveInside(std::int32_t v);
  bool moveAlongBorder(std::int32_t v);
  template <typename Propose>
  bool moveByShare(std::int32_t v, const Propose& propose);
  bool mayMove(std::int32_t v, const Corner& moved) const;
  bool hasMoved(std::int32_t v) const;
  void takeBack(std::int32_t v);

  RemeshedSurface& surface_;
  float share_;
  Execution& execution_;
  std::vector<Step> steps_;
  std::vector<std::uint8_t> isWaiting_;
  std::vector<Eigen::Vector3f> formerPositions_, formerNormals_;
  std::vector<double> formerPlaces_;
};

} // namespace mrf
} // namespace pcl

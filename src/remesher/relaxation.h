// SPDX-License-Identifier: BSD-3-Clause
/// The pass of the remesher that makes triangles even.
#pragma once

#include "remesher/remeshed_surface.h"

#include <pcl/surface/mrf/execution.h>

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <vector>

namespace pcl::mrf {

/// Moves each vertex towards the centroid of its neighbors on the surface.
class Relaxation {
public:
  Relaxation(RemeshedSurface& surface, Execution& execution);

  /// All steps are computed from the same state, in parallel; they are taken one by one, each against the state it
  /// meets. Vertices of a range whose neighbors all belong to it move while other ranges do the same; the rest move
  /// after them. \pre no triangle was removed since the mesh was compacted
  void moveAll();

private:
  struct Step {
    Eigen::Vector3f tangential = Eigen::Vector3f::Zero();
    std::optional<Corner> reached; ///< by the whole step, then to the zero level; on the border not in use
    bool isSettled = false;        ///< the step is not worth the way
  };

  std::vector<float> relativeAreas() const;
  void computeSteps();
  void moveInRanges();
  void moveWaiting();
  bool move(std::int32_t v);
  bool moveInside(std::int32_t v);
  bool moveAlongBorder(std::int32_t v);
  template <typename Propose>
  bool moveByShare(std::int32_t v, const Propose& propose);

  RemeshedSurface& surface_;
  Execution& execution_;
  std::vector<Step> steps_;
  std::vector<std::uint8_t> isWaiting_;
};

} // namespace pcl::mrf

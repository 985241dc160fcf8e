// SPDX-License-Identifier: BSD-3-Clause
/// The way back of vertices whose triangles came to intersect.
#pragma once

#include "remesher/intersection_watch.h"
#include "remesher/remeshed_surface.h"

#include <pcl/surface/mrf/execution.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Where vertices are before a pass that moves them.
class FormerVertices {
public:
  explicit FormerVertices(RemeshedSurface& surface);

  /// Takes vertices of intersecting triangles back to where they were, and what would be a bad triangle then as well,
  /// until no triangles intersect. \return the corners of those that do and did not move
  std::vector<std::int32_t> takeBackWhatIntersects(const IntersectionWatch& watch, Execution& execution);

private:
  bool hasMoved(std::int32_t v) const;
  void takeBack(std::int32_t v);

  RemeshedSurface& surface_;
  const std::vector<Eigen::Vector3f> positions_, normals_;
  const std::vector<double> places_;
};

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// Tells triangles that fill holes and gaps of the surface supported by data from extrapolation (trimming).
#pragma once

#include "trimming/closing.h"
#include "trimming/trimming.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cmath>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Max widths of fillings, cloud's unit.
struct FillingLimits {
  double hole; ///< if filling closes the surface
  double gap;  ///< if it stays open
  /// True: fillings are kept even if they outgrow their rim, turn away from the surface around, or sensors saw through
  /// them. False: the first are dropped; the others, if points have spacings, only where they are wide in those.
  bool closesBridges;
};

/// The nearest data point of each vertex that was asked for, searched once.
class NearestPoints {
public:
  NearestPoints(const TriangleMesh& mesh, const NeighborSearch& search, Execution& execution)
      : mesh_(mesh), search_(search), execution_(execution)
  {}

  /// Searches for those that are not known yet.
  void find(const std::vector<std::int32_t>& vertices);

  /// \pre the vertex was searched for, and there are points
  std::size_t point(std::int32_t vertex) const;
  float squaredDistance(std::int32_t vertex) const;

private:
  const TriangleMesh& mesh_;
  const NeighborSearch& search_;
  Execution& execution_;
  std::vector<float> squared_; ///< by vertex; empty until the first search
  std::vector<std::int32_t> points_;
};

/// Tells fillings of holes from extrapolation, as trim() describes it. Flags are one per triangle of the mesh.
class HoleFinder {
public:
  /// \param supported flags of triangles that data support \pre the arguments outlive this
  HoleFinder(const TriangleMesh& mesh, const std::vector<std::uint8_t>& supported, const OrientedPoints& points,
             const NeighborSearch& search, Execution& execution);

  /// Flags of the supported triangles and of those that fill a hole or a gap.
  std::vector<std::uint8_t> keepFillings(const FillingLimits& limits);

  /// Counts and measures what became of the unsupported triangles.
  void describe(const std::vector<std::uint8_t>& keep, TrimResult& result);

private:
  /// An edge-connected set of unsupported triangles.
  struct Region {
    bool touchesBoundary = false;
    bool hasSupportedNeighbor = false;
    double area = 0;
    float squaredReach = 0; ///< largest squared distance of a vertex to the nearest data point
    bool outgrowsRim = false;

    bool isBounded() const { return hasSupportedNeighbor && !touchesBoundary; }
    double diameter() const { return 2 * std::sqrt(static_cast<double>(squaredReach)); }
    bool fits(double limit) const { return isBounded() && !outgrowsRim && diameter() <= limit; }
  };

  std::int32_t group(const std::vector<std::int32_t>& triangles, std::vector<std::int32_t>& groupOf) const;
  template <typename Needs>
  void measureReach(const std::vector<std::int32_t>& regionOf, const Needs& needs, std::vector<Region>& regions);
  void findRegions();
  void compareWithRims();
  void findOpenRegions(double maxHole);
  void keepGaps(double gap, std::vector<std::uint8_t>& keep);
  std::vector<RimVertex> describeRim(const std::vector<std::int32_t>& vertices);
  std::vector<std::int32_t> fillings(const std::vector<std::uint8_t>& keep) const;
  bool isBeyond(std::int32_t triangle, float spacings) const;
  void dropSeenThrough(std::vector<std::uint8_t>& keep);
  double area(std::size_t triangle) const;
  Eigen::Vector3f normalOf(std::int32_t triangle) const;
  void dropDoubtful(float from, float ifBeyond, std::vector<std::uint8_t>& keep);

  const TriangleMesh& mesh_;
  const std::vector<std::uint8_t>& supported_;
  const OrientedPoints& points_;
  Execution& execution_;
  NearestPoints nearest_;
  std::vector<std::int32_t> unsupported_; ///< triangles, ascending: most meshes have few
  std::vector<Region> regions_;
  std::vector<std::int32_t> regionOf_;     ///< per triangle; negative for supported ones
  std::vector<std::uint8_t> isOnBoundary_; ///< per vertex of unsupported triangles: the mesh ends there
  std::vector<std::uint8_t> isOpen_;       ///< per region: filling does not close its component
};

} // namespace pcl::mrf

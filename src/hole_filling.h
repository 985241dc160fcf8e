/// \file
/// \brief What of a mesh fills holes and gaps of the surface that data support, and what is extrapolation (trimming).
#pragma once

#include "mesh_topology.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbour_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>
#include <pcl/surface/mrf/trimming.h>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// The triangles without support and their vertices, ascending: most meshes have few, and none of the rest is visited.
struct Unsupported {
  std::vector<std::int32_t> triangles, vertices;

  Unsupported(const TriangleMesh& mesh, const std::vector<std::uint8_t>& supported);
};

/// Distances to the nearest data point, measured where they are asked for, each once.
class DataDistances {
public:
  DataDistances(const TriangleMesh& mesh, const Unsupported& unsupported, const NeighbourSearch& search,
                Execution& execution)
      : mesh_(mesh), vertices_(unsupported.vertices), search_(search), execution_(execution),
        squared_(vertices_.size(), unknown)
  {}

  /// Squared distance of a vertex of an unsupported triangle. \pre it was measured
  float squared(std::int32_t vertex) const { return squared_[placeOf(vertex)]; }

  /// Measures the vertices of those triangles for which `needs` holds.
  template <typename Needs>
  void measure(const std::vector<std::int32_t>& triangles, const Needs& needs)
  {
    std::vector<std::uint8_t> isNeeded(vertices_.size(), 0);
    for (const std::int32_t t : triangles)
      if (needs(t))
        for (const std::int32_t v : mesh_.triangles[at(t)])
          isNeeded[placeOf(v)] = 1;
    execution_.forRange(static_cast<std::int64_t>(isNeeded.size()), 1024, [&](std::int64_t begin, std::int64_t end) {
      Neighbours nearest;
      for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n)
        if (isNeeded[n] && squared_[n] == unknown && search_.nearest(mesh_.vertices[at(vertices_[n])], 1, nearest) > 0)
          squared_[n] = nearest.squaredDistances.front();
    });
  }

private:
  static constexpr float unknown = -1;

  std::size_t placeOf(std::int32_t vertex) const
  {
    return static_cast<std::size_t>(std::lower_bound(vertices_.begin(), vertices_.end(), vertex) - vertices_.begin());
  }

  const TriangleMesh& mesh_;
  const std::vector<std::int32_t>& vertices_;
  const NeighbourSearch& search_;
  Execution& execution_;
  std::vector<float> squared_; ///< of unsupported.vertices
};

/// How wide what is filled may be, cloud's unit.
struct FillingLimits {
  double hole; ///< where filling closes the surface
  double gap;  ///< elsewhere
};

/// The supported triangles and those that fill a hole or a gap, as trim describes it.
/// \param closesBridges what turns away from the surface around it is closed like the rest; else, if the points have
/// spacings, only up to 28 of those
/// \return one flag per triangle
std::vector<std::uint8_t> keepFillings(const TriangleMesh& mesh, const Unsupported& unsupported,
                                       const std::vector<std::uint8_t>& supported, const std::vector<double>& areas,
                                       const OrientedPoints& points, const NeighbourSearch& search,
                                       const FillingLimits& limits, bool closesBridges, DataDistances& distances,
                                       Execution& execution);

/// Counts and measures what became of the unsupported triangles.
void describeFillings(const TriangleMesh& mesh, const Unsupported& unsupported, const std::vector<std::uint8_t>& keep,
                      const std::vector<double>& areas, DataDistances& distances, TrimResult& result,
                      Execution& execution);

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
/// Per-vertex fields of the output: normals, confidence, attributes of the input, colors.
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <vector>

namespace pcl::mrf {

/// Sets the normals: the normalized gradient of the field; the mean triangle normal where it vanishes.
void setNormals(TriangleMesh& mesh, const DistanceField& field, Execution& execution);

/// How far each point supports a surface around it: dEmax, and up to four times as far where the points lie farther
/// apart than on average, or are known to be off as far: a wall at six meters is as much surface as a cup at one.
class Support {
public:
  /// \param search holds points.positions \param maxDistance dEmax, cloud's unit, > 0
  /// \param spacing l̄, cloud's unit; 0, or points without spacings: dEmax is the same everywhere
  /// \pre the arguments outlive this
  Support(const OrientedPoints& points, const NeighborSearch& search, float maxDistance, float spacing)
      : points_(points), search_(search), maxDistance_(maxDistance), spacing_(points.spacings.empty() ? 0 : spacing)
  {}

  const OrientedPoints& points() const { return points_; }
  const NeighborSearch& search() const { return search_; }

  /// What the nearest point leaves of its reach at a position: ≤ 0 without support, −inf without points.
  float margin(const Eigen::Vector3f& position, Neighbors& scratch) const;

  /// No point supports anything farther away. Cloud's unit.
  float farthestReach() const
  {
    return spacing_ > 0 || !points_.deviations.empty() ? farthest * maxDistance_ : maxDistance_;
  }

  /// Paper Sec. 3.3.3: α by the distance to the nearest point, times that point's own confidence.
  float confidence(const Eigen::Vector3f& position, ConfidenceShape shape, Neighbors& scratch) const;

  /// How far a point supports a surface, cloud's unit.
  float reach(std::size_t point) const;

  /// How many times as far apart as in the median of the cloud points are: around the nearest one to a position, or
  /// where they are sparsest. 1 where there are none, or the reach is the same everywhere.
  float sparseness(const Eigen::Vector3f& position, Neighbors& scratch) const;
  float largestSparseness() const;

private:
  static constexpr float farthest = 4;     ///< in dEmax
  static constexpr float perDeviation = 3; ///< in σ: of Gaussian noise one point of 370 is farther off

  const OrientedPoints& points_;
  const NeighborSearch& search_;
  float maxDistance_, spacing_;
};

/// Sets the confidences. Cost: one query per vertex.
void setConfidences(TriangleMesh& mesh, const Support& support, ConfidenceShape shape, Execution& execution);

/// Length that edges around each vertex should have, relative to those where points are as dense as in the median.
using EdgeSizing = std::vector<float>;

/// Edges as long as the points allow: where the spacing around the nearest point is more than 2.5 times the cloud's,
/// edges are as much longer, where it is less than 1.75 times they are not longer at all (ours).
/// \return empty if no point is sparse. Cost: one query per vertex else
EdgeSizing edgeSizing(const TriangleMesh& mesh, const Support& support, Execution& execution);

/// Interpolates attributes of the data points at the vertices: mean of the 4 nearest points with weights 1/d², the
/// nearest one's value where it coincides.
/// \param read writes `channels` values of one of the search's points
/// \return `channels` values per vertex
std::vector<float> interpolateAttributes(const std::vector<Eigen::Vector3f>& vertices, const NeighborSearch& search,
                                         const AttributeReader& read, int channels, Execution& execution);

/// Interpolated channels 0..255 as a color, rounded. \param channels three values
Rgb toRgb(const float* channels);

} // namespace pcl::mrf

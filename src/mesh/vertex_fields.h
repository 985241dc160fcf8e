// SPDX-License-Identifier: BSD-3-Clause
/// Per-vertex fields of the output: normals, confidence, attributes of the input, colors.
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <algorithm>
#include <vector>

namespace pcl::mrf {

/// Sets the normals: the normalized gradient of the field; where that vanishes, the mean triangle normal.
void setNormals(TriangleMesh& mesh, const DistanceField& field, Execution& execution);

/// How far each point supports the surface around it: dEmax, or farther where the points are sparser than on average or
/// their known noise is larger: a wall at six meters is as much surface as a cup at one. Up to four times as far,
/// except amid points that lie evenly on a plane: those of a lidar's rings do not tell what is between these.
class Support {
public:
  /// \param search holds points.positions \param maxDistance dEmax, cloud's unit, > 0
  /// \param spacing l̄, cloud's unit; 0, or points without spacings: dEmax is the same everywhere
  /// \pre the arguments outlive this
  Support(const OrientedPoints& points, const NeighborSearch& search, float maxDistance, float spacing);

  const OrientedPoints& points() const { return points_; }
  const NeighborSearch& search() const { return search_; }

  /// Max reach of a point, cloud's unit.
  float farthestReach() const
  {
    const float most = spacing_ > 0 || !points_.deviations.empty() ? farthest : 1;
    return maxDistance_ * std::max(most, largestSparseness_ / atBorder);
  }

  /// α from the distance to the nearest point, times that point's own confidence (paper Sec. 3.3.3).
  float confidence(const Eigen::Vector3f& position, ConfidenceShape shape, Neighbors& scratch) const;

  /// How far a point supports a surface, cloud's unit.
  float reach(std::size_t point) const;

  /// Spacing around the point nearest to a position, or the largest one of all points, over the cloud's spacing l̄.
  /// 1 if there are no points, or the reach is the same everywhere.
  float sparseness(const Eigen::Vector3f& position, Neighbors& scratch) const;
  float largestSparseness() const { return largestSparseness_; }

private:
  /// At the rim a point's 8th neighbor is √2 times as far as in the middle.
  static constexpr float atBorder = 1.5f;
  static constexpr float farthest = 4;     ///< max reach, in dEmax, except amid even points
  static constexpr float perDeviation = 3; ///< reach in σ: one of 370 points with Gaussian noise is farther off

  bool isAmidEvenOnes(std::size_t point) const;

  const OrientedPoints& points_;
  const NeighborSearch& search_;
  float maxDistance_, spacing_, largestSparseness_;
};

/// Sets the confidences. Cost: one query per vertex.
void setConfidences(TriangleMesh& mesh, const Support& support, ConfidenceShape shape, Execution& execution);

/// Target length of the edges around each vertex, relative to the one where points have the cloud's median spacing.
using EdgeSizing = std::vector<float>;

/// Longer edges where points are sparse (ours). If the spacing around the nearest point is r times the cloud's, edges
/// are r times as long for r of 2.5 and more, not longer up to 1.75, and linear between.
/// \return empty if no point is sparse; otherwise the cost is one query per vertex
EdgeSizing edgeSizing(const TriangleMesh& mesh, const Support& support, Execution& execution);

/// Interpolates attributes of the data points at the vertices: the mean of the 4 nearest points with weights 1/d², or
/// the value of a point at the vertex itself.
/// \param read writes `channels` values of one of the search's points
/// \return `channels` values per vertex
std::vector<float> interpolateAttributes(const std::vector<Eigen::Vector3f>& vertices, const NeighborSearch& search,
                                         const AttributeReader& read, int channels, Execution& execution);

/// Interpolated channels 0..255 as a color, rounded. \param channels three values
Rgb toRgb(const float* channels);

} // namespace pcl::mrf

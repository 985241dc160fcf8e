// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Points as the stages see them: plain arrays in a recentered frame, without PCL point types.
#pragma once

#include <pcl/surface/mrf/export.h>

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace pcl {
namespace mrf {

/// The gathered input: finite points relative to `offset`, so that float arithmetic is accurate for any survey frame.
/// Optional per-point arrays are either empty or as long as `positions`.
struct PointSet {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals; ///< from the cloud, unit length; empty: the cloud has none or they are ignored
  std::vector<float> confidences;       ///< the scanner's, 0..1; empty: 1 everywhere
  std::vector<std::int32_t> views;      ///< index into `sensors` per point; empty: unknown
  std::vector<float> spacings;          ///< local sampling distance, see localSpacings; empty: not measured
  std::vector<std::uint32_t> origins;   ///< index of each point in the cloud it came from
  std::vector<Eigen::Vector3f> sensors; ///< sensor positions, in the same recentered frame; empty: unknown
  Eigen::Vector3d offset = Eigen::Vector3d::Zero(); ///< add it to a position to be back in the cloud's frame
  float resolution = 0;            ///< steps of the largest coordinate as it came in single precision, cloud's unit
  bool hasSensorOrigin = false;    ///< the one sensor is the cloud's own origin, which nobody gave explicitly
  bool hadOnlyZeroNormals = false; ///< the cloud's normals, all zero or not finite, were left out

  std::size_t size() const { return positions.size(); }
};

/// The points of `points` whose flag in `keep` is set, in their order; all per-point arrays follow, the rest is copied.
/// \pre keep.size() == points.size()
PCL_MRF_EXPORT PointSet select(const PointSet& points, const std::vector<std::uint8_t>& keep);

/// Points with a unit normal each: what the observation stage reads.
struct OrientedPoints {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals; ///< unit length, pointing out of the object; same length as positions
  std::vector<float> confidences;       ///< 0..1; empty: 1 everywhere
  std::vector<float> spacings;          ///< local sampling distance, see localSpacings; empty: the same everywhere
  std::vector<std::uint32_t> origins;   ///< index of each point in the input cloud
  /// Where the points were seen from, in the recentered frame; empty: unknown. Nobody need have named them, see trim.
  std::vector<Eigen::Vector3f> sensors;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();

  std::size_t size() const { return positions.size(); }
  float confidence(std::size_t i) const { return confidences.empty() ? 1.0f : confidences[i]; }
};

/// The same for oriented points.
PCL_MRF_EXPORT OrientedPoints select(const OrientedPoints& points, const std::vector<std::uint8_t>& keep);

/// The points with these indices, in that order.
PCL_MRF_EXPORT OrientedPoints select(const OrientedPoints& points, const std::vector<std::uint32_t>& indices);

/// Axis-aligned bounding box; `diagonal` is 0 for an empty set.
struct BoundingBox {
  Eigen::Vector3f lower = Eigen::Vector3f::Zero();
  Eigen::Vector3f upper = Eigen::Vector3f::Zero();
  float diagonal() const { return (upper - lower).norm(); }
};
PCL_MRF_EXPORT BoundingBox boundingBox(const std::vector<Eigen::Vector3f>& positions);

/// Writes the values of a point, by its index. Called from several threads at once.
using AttributeReader = std::function<void(std::size_t point, float* values)>;

} // namespace mrf
} // namespace pcl

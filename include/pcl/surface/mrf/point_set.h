// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Input clouds and the point sets of the stages: plain arrays without PCL point types.
#pragma once

#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/options.h>

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace pcl::mrf {

/// What is known of each point, in a frame relative to `offset`, so that float arithmetic is accurate for any survey
/// frame. Optional per-point arrays are either empty or as long as `positions`.
struct PointArrays {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals; ///< unit length, or zero where there is none; empty: the cloud has none
  std::vector<float> confidences;       ///< the scanner's, 0..1; empty: 1 everywhere
  std::vector<float> deviations;        ///< known σ of the noise, cloud's unit; empty: unknown, or the same for all
  std::vector<std::int32_t> views;      ///< index into `sensors` per point; empty: unknown
  std::vector<float> spacings;          ///< local sampling distance, see localSpacings; empty: not measured
  std::vector<std::uint32_t> origins;   ///< index of each point in the cloud it came from
  std::vector<Eigen::Vector3f> sensors; ///< sensor positions, in the same frame; empty: unknown
  Eigen::Vector3d offset = Eigen::Vector3d::Zero(); ///< add it to a position to be back in the cloud's frame

  std::size_t size() const { return positions.size(); }
};

/// The gathered input: finite points.
struct PointSet : PointArrays {
  std::size_t gathered = 0;        ///< number of usable points in the cloud, before any was dropped; 0: size()
  float resolution = 0;            ///< step between floats at the largest coordinate of the input, cloud's unit
  bool hasSensorOrigin = false;    ///< the only sensor is the cloud's own sensor origin, not one given explicitly
  bool hadOnlyZeroNormals = false; ///< the normals were removed, because all were zero or not finite

  /// Number of points that shares of the cloud refer to.
  std::size_t wholeSize() const { return gathered > 0 ? gathered : size(); }
};

/// Points with unit normals that point out of the object: the input of the observation stage. A sensor may be one that
/// was only supposed, see Report::sensorSupposed.
struct OrientedPoints : PointArrays {
  float typicalDeviation = 0; ///< σ of the median point, cloud's unit; 0: weights do not depend on σ

  float confidence(std::size_t i) const { return confidences.empty() ? 1.0f : confidences[i]; }
  /// Known σ of a point's noise, cloud's unit; 0: unknown.
  float deviation(std::size_t i) const { return deviations.empty() ? 0 : deviations[i]; }
};

/// The points whose flag in `keep` is set, in their order. Each array of `points` is freed before the next one is
/// selected. \pre keep.size() == points.size()
PCL_MRF_EXPORT PointSet select(PointSet points, const std::vector<std::uint8_t>& keep);
PCL_MRF_EXPORT OrientedPoints select(OrientedPoints points, const std::vector<std::uint8_t>& keep);

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

/// Values of a cloud's points beside their geometry, to be interpolated at the vertices of the mesh.
struct PointAttributes {
  bool colors = false;      ///< red, green and blue 0..255 of each point
  bool intensities = false; ///< one value of each point, after its color
  /// Called only for points next to a vertex, so that nothing is copied beforehand.
  AttributeReader read;
};

/// An input cloud without PCL's point types. Per-point arrays are either empty or as long as `positions`.
struct RawCloud {
  std::vector<Eigen::Vector3f> positions; ///< possibly not finite
  std::vector<Eigen::Vector3f> normals;   ///< of any length; empty: none
  std::vector<float> confidences;         ///< the scanner's, 0..1; empty: 1 everywhere
  std::vector<float> deviations;        ///< σ of each point's noise, cloud's unit, > 0; empty: see Options::noiseModel
  std::vector<std::int32_t> views;      ///< index into `sensors` per point; empty: unknown
  std::vector<Eigen::Vector3d> sensors; ///< in the cloud's frame; empty: unknown
  /// Sensor position that the cloud itself has, used only if `sensors` is empty; see OrientationOptions::sensorOrigin.
  std::optional<Eigen::Vector3d> sensorOrigin;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero(); ///< add it to positions to be in the cloud's frame
  float resolution = 0; ///< step to which coordinates were rounded before the offset was subtracted; 0: not rounded
  PointAttributes attributes;
};

/// Whether an organized cloud may be the image of a sensor at zero: its columns go to the right of rows that go down,
/// or the other way round if the points are all around. When pcl::transformPointCloud has moved a cloud and left its
/// origin where it was, zero may be behind the surface, where the image is mirrored. \param position of a point, by its
/// index row · width + column
PCL_MRF_EXPORT bool isImageFromZero(std::size_t width, std::size_t height,
                                    const std::function<Eigen::Vector3f(std::size_t)>& position);

/// The cloud's sensors or, if it has none and the options allow it, its own sensor origin.
PCL_MRF_EXPORT std::vector<Eigen::Vector3d> sensorsOf(const RawCloud& cloud, const Options& options);

/// \throw InvalidInput if an array is too short or too long, a deviation is not above 0, or a view names no sensor
PCL_MRF_EXPORT void validate(const RawCloud& cloud);

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The whole method as one function of plain inputs: points → oriented points → observation → field → mesh.
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <exception>
#include <optional>
#include <vector>

namespace pcl {
namespace mrf {

/// What a cloud has beside its geometry, to be interpolated at the vertices of the mesh: colors as red, green and blue
/// 0..255, or one intensity.
struct PointAttributes {
  int channels = 0; ///< values per point; 0: none
  /// Writes the values of a point of the cloud, by its index. Called from several threads at once, and only for points
  /// next to a vertex: nothing is copied before.
  AttributeReader read;
};

/// A cloud as it comes, without PCL's point types. Arrays are either empty or as long as `positions`, but for sensors.
struct RawCloud {
  std::vector<Eigen::Vector3f> positions; ///< possibly not finite
  std::vector<Eigen::Vector3f> normals;   ///< of any length; empty: none
  std::vector<float> confidences;         ///< the scanner's, 0..1; empty: 1 everywhere
  std::vector<std::int32_t> views;        ///< index into `sensors` per point; empty: unknown
  std::vector<Eigen::Vector3d> sensors;   ///< in the cloud's frame; empty: unknown
  /// Where the cloud itself says that its sensor was, see OrientationOptions::sensorOrigin; counts without `sensors`.
  std::optional<Eigen::Vector3d> sensorOrigin;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero(); ///< add it to positions to be in the cloud's frame
  PointAttributes attributes;
};

/// The cloud's sensors, or else the one that it names itself if the options let that count.
PCL_MRF_EXPORT std::vector<Eigen::Vector3d> sensorsOf(const RawCloud& cloud, const Options& options);

/// \throw InvalidInput if an array is too short or too long, or a view names no sensor
PCL_MRF_EXPORT void validate(const RawCloud& cloud);

struct Reconstruction {
  TriangleMesh mesh;             ///< with normals and confidences, in the recentered frame (add points.offset)
  std::vector<float> attributes; ///< of the cloud, interpolated, `channels` per vertex; empty: it has none, or
                                 ///< Options::colors does not ask for them
  int channels = 0;
  /// UncertaintyOptions::surfaces, each as the distances that the vertices move along their normals, cloud's unit; see
  /// displaced(). Over all draws the root mean square of a vertex is its sigma.
  std::vector<std::vector<float>> surfaces;
  DistanceField field;   ///< the regularized field of the finest level, same frame
  OrientedPoints points; ///< what was observed
  Report report;
};

/// The color of each vertex as Options::colors asks for it: by its confidence, its sigma, or the input's; empty: none.
PCL_MRF_EXPORT std::vector<Rgb> vertexColors(const Reconstruction& result);

/// Runs all stages: the one way from a cloud to a mesh, of the class for PCL's point types as of the tools.
/// \param cloud moved in, so that its arrays are freed as soon as the stages have read them
/// \param search is used for every query; see makePointBins
/// \param result replaced; after an error its report has what was done so far and the rest is empty or partial
/// \throw InvalidInput, InvalidOption, ResourceLimit, SolverFailure, Cancelled; and whatever the search or the progress
/// callback throw
/// Points nearer than 1e-8 to each other on average, or in a box with a diagonal above 1e9, are refused as
/// InvalidInput. The result is the same bytes for any number of threads.
PCL_MRF_EXPORT void reconstruct(RawCloud cloud, const Options& options, NeighborSearch& search, Execution& execution,
                                Reconstruction& result);

/// The same by the library's own search, for whoever needs no report of a failure.
PCL_MRF_EXPORT Reconstruction reconstruct(RawCloud cloud, const Options& options, Execution& execution);

/// Sets status and message of the report by what was thrown: the module's errors as they are, std::bad_alloc as a
/// resource limit, all others as internal errors.
PCL_MRF_EXPORT void setFailure(const std::exception_ptr& error, Report& report) noexcept;

} // namespace mrf
} // namespace pcl

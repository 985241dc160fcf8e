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

#include <exception>

namespace pcl {
namespace mrf {

struct Reconstruction {
  TriangleMesh mesh;     ///< with normals and confidences, in the recentered frame (add points.offset)
  DistanceField field;   ///< the regularized field of the finest level, same frame
  OrientedPoints points; ///< what was observed
  Report report;
};

/// Builds the gathered points: the part of a cloud the stages can use.
/// \param positions in the cloud's frame, possibly not finite
/// \param normals empty or one per position; \param confidences, views likewise
/// \param sensors positions in the cloud's frame
/// \param counts receives input, notFinite, duplicates, zeroNormals, zeroConfidence
/// \throw InvalidInput if a sensor is not finite, or farther than 1e18 from the cloud
/// Points with a normal that is zero or not finite are dropped only if `normalsNeeded`. If all normals are, they are
/// left out instead, as of a cloud that has none yet. Of equal positions the first is kept.
/// \return the points along a space-filling curve, so that the stages find neighbors close in memory; neither their
/// positions nor their order depend on the order they came in
PCL_MRF_EXPORT PointSet gather(const std::vector<Eigen::Vector3f>& positions,
                               const std::vector<Eigen::Vector3f>& normals, const std::vector<float>& confidences,
                               const std::vector<std::int32_t>& views, const std::vector<Eigen::Vector3d>& sensors,
                               bool normalsNeeded, PointCounts& counts, Execution& execution);

/// The same on one thread.
PCL_MRF_EXPORT PointSet gather(const std::vector<Eigen::Vector3f>& positions,
                               const std::vector<Eigen::Vector3f>& normals, const std::vector<float>& confidences,
                               const std::vector<std::int32_t>& views, const std::vector<Eigen::Vector3d>& sensors,
                               bool normalsNeeded, PointCounts& counts);

/// Section 3.1: outliers, normals, components, orientation. Fills the report's density, counts and orientation.
/// \param search is given the points that are left; it holds result.positions on return
/// \throw InvalidInput if too few points are left
PCL_MRF_EXPORT OrientedPoints preprocess(PointSet points, const Options& options, NeighborSearch& search,
                                         Report& report, Execution& execution);

/// Runs all stages.
/// \param points as gather gives them, with the counts it gave
/// \param search is used for every query; see makePointBins
/// \param result replaced; after an error its report has what was done so far and the rest is empty or partial
/// \throw InvalidInput, InvalidOption, ResourceLimit, SolverFailure, Cancelled; and whatever the search or the progress
/// callback throw
/// Points nearer than 1e-8 to each other on average, or in a box with a diagonal above 1e9, are refused as
/// InvalidInput. The result is the same bytes for any number of threads.
PCL_MRF_EXPORT void reconstruct(PointSet points, const PointCounts& counts, const Options& options,
                                NeighborSearch& search, Execution& execution, Reconstruction& result);

/// Sets status and message of the report by what was thrown: the module's errors as they are, std::bad_alloc as a
/// resource limit, all others as internal errors.
PCL_MRF_EXPORT void setFailure(const std::exception_ptr& error, Report& report) noexcept;

} // namespace mrf
} // namespace pcl

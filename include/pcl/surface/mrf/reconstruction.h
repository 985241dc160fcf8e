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
#include <vector>

namespace pcl::mrf {

struct Reconstruction {
  TriangleMesh mesh;       ///< with normals and confidences, in the recentered frame (add points.offset)
  std::vector<Rgb> colors; ///< the cloud's color at each vertex; empty without it, or if Options::colors is not `input`
  std::vector<float> intensities; ///< the cloud's intensity at each vertex; likewise
  /// The plausible surfaces, UncertaintyOptions::surfaces of them: for each the distances of the vertices along their
  /// normals, cloud's unit; see displaced(). The root mean square over all draws is the vertex's sigma.
  std::vector<std::vector<float>> surfaces;
  DistanceField field;   ///< the regularized field of the finest level, same frame
  OrientedPoints points; ///< the points that were observed
  Report report;
};

/// The color of each vertex as Options::colors selects it: by confidence, by sigma, or the input's; empty: none.
PCL_MRF_EXPORT std::vector<Rgb> vertexColors(const Reconstruction& result);

/// Runs all stages. The class for PCL's point types and the tools call this function.
/// \param cloud moved in, so that its arrays are freed as soon as the stages have read them
/// \param search used for all queries, except for pieces of a cloud that are far apart: they use Options::search
/// \param result replaced; after an error its report is filled up to the error, the rest is empty or partial
/// \param keepsPoints whether the result keeps the points; if not, it keeps only their offset, and other data of the
/// points are freed early: 4 bytes per point from the beginning, 16 while the mesh is remeshed
/// \throw InvalidInput, also if the mean distance of points is below 1e-8 or the box's diagonal above 1e9;
/// InvalidOption, ResourceLimit, SolverFailure, Cancelled; CallerError if the progress callback or the reader of
/// attributes throws; whatever the search throws
PCL_MRF_EXPORT void reconstruct(RawCloud cloud, const Options& options, NeighborSearch& search, Execution& execution,
                                Reconstruction& result, bool keepsPoints = true);

/// The same with the search of Options::search; a failure leaves no report.
PCL_MRF_EXPORT Reconstruction reconstruct(RawCloud cloud, const Options& options, Execution& execution);

/// Sets status and message of the report from an exception: the module's errors unchanged, std::bad_alloc as a resource
/// limit, all others as internal errors.
PCL_MRF_EXPORT void setFailure(const std::exception_ptr& error, Report& report) noexcept;

} // namespace pcl::mrf

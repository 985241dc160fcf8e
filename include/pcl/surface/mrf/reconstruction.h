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
  TriangleMesh mesh;              ///< with normals and confidences, in the recentered frame (add points.offset)
  std::vector<Rgb> colors;        ///< of the cloud, interpolated; empty: it has none, or Options::colors does not ask
  std::vector<float> intensities; ///< likewise
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
/// \param search is used for all queries but those of parts far apart, which have searches of Options::search
/// \param result replaced; after an error its report has what was done so far and the rest is empty or partial
/// \param keepsPoints whether the result has the points; if not, only their offset, and what of them is not needed any
/// more is freed on the way: 4 bytes per point from the beginning, 16 while the mesh is remeshed
/// \throw InvalidInput, InvalidOption, ResourceLimit, SolverFailure, Cancelled; CallerError for what the progress
/// callback or the reader of attributes throw; whatever the search throws
/// Points nearer than 1e-8 on average, or in a box with a diagonal above 1e9, are refused as InvalidInput.
PCL_MRF_EXPORT void reconstruct(RawCloud cloud, const Options& options, NeighborSearch& search, Execution& execution,
                                Reconstruction& result, bool keepsPoints = true);

/// The same by the library's own search, for whoever needs no report of a failure.
PCL_MRF_EXPORT Reconstruction reconstruct(RawCloud cloud, const Options& options, Execution& execution);

/// Sets status and message of the report by what was thrown: the module's errors as they are, std::bad_alloc as a
/// resource limit, all others as internal errors.
PCL_MRF_EXPORT void setFailure(const std::exception_ptr& error, Report& report) noexcept;

} // namespace pcl::mrf

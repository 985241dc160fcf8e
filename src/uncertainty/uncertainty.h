// SPDX-License-Identifier: BSD-3-Clause
/// Sigma at the vertices of a mesh: posterior draws on a coarse grid, calibrated by points that are left out; see
/// src/method.md, "Error bars".
#pragma once

#include "levels/multiscale.h"
#include "options/resolved_options.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <vector>

namespace pcl::mrf {

/// Draws from the posterior of one piece. Draws of all pieces with the same index belong together.
struct PieceDraws {
  BoundingBox volume;
  std::vector<DistanceField> draws;
};

/// Sets the sigmas of the mesh and their flags `calibrated`. \param pieces of the points: all of them
/// \param field of the finest level \param run density and noise of the points \param options observing at points
/// \param mesh with confidences \param draws receives the draws that sigma was computed from
/// The result does not depend on the number of threads.
UncertaintyReport estimateUncertainty(const std::vector<SolvedPiece>& pieces, const DistanceField& field,
                                      const Report& run, const ResolvedOptions& options, TriangleMesh& mesh,
                                      std::vector<PieceDraws>& draws, Execution& execution);

/// Sets the report's statistics of the sigmas of a mesh.
void describeSigmas(const TriangleMesh& mesh, UncertaintyReport& report);

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// Sigma at the vertices of a mesh: posterior draws on a coarse grid, calibrated by what the cloud withholds.
///
/// The draws give the posterior's variance V at a place for data of variance 1 (posterior_draws.h). The model is
/// over-sure where there are points: what is left there is shape that the grid does not resolve, not noise. So what V
/// is multiplied with is learnt from points that are left out:
///
/// - In fillings by discs as wide as the openings (opening_patches.h), filled on the coarse grid: σ² = f² V + K.
/// - Amid the data by what pairs of points next to each other share (held_out_pairs.h): the surface's error, not the
///   scanner's. It is spread over the surface by V and by δ, the distance between the surface and that of the coarse
///   grid: where refining has changed much, more is left to change. Where neighbors share their noise (points/noise.h),
///   pairs do as well, and the error is a share of that noise, which varies as it does.
///
/// Discs and pairs are few on some clouds, so that all factors are drawn towards those that were learnt on simulated
/// scans; see SigmaModel. What no point tells of is not in sigma: views that are misplaced against each other, normals
/// that point to the wrong side, sheets that noise has joined.
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

/// Draws from the posterior, piece by piece; those of one number belong together.
struct PieceDraws {
  BoundingBox volume;
  std::vector<DistanceField> draws;
};

/// Sets the sigmas and the flags of what is calibrated. \param pieces of the points: all of them
/// \param field of the finest level \param run density and noise of the points \param options observing at points
/// \param mesh with confidences \param draws receives those that sigma was made of
/// The result does not depend on the number of threads.
UncertaintyReport estimateUncertainty(const std::vector<SolvedPiece>& pieces, const DistanceField& field,
                                      const Report& run, const ResolvedOptions& options, TriangleMesh& mesh,
                                      std::vector<PieceDraws>& draws, Execution& execution);

/// Sets what the report says of the sigmas of a mesh.
void describeSigmas(const TriangleMesh& mesh, UncertaintyReport& report);

} // namespace pcl::mrf

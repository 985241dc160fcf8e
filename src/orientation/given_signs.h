// SPDX-License-Identifier: BSD-3-Clause
/// Tells whether the signs of the normals that came with a cloud are plausible (ours).
#pragma once

#include "points/preprocessing.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/report.h>

#include <Eigen/Core>

#include <vector>

namespace pcl::mrf {

/// True, with a warning, if the signs of the given normals are errors: a quarter of the neighbors on smooth surface
/// have opposite signs; or the points enclose a volume, no sensor is known, and more than a tenth of the normals look
/// into it. In a room all normals look inward; the objects that stand in it tell it from an object. See src/method.md.
/// \param search holds the points. Cost: some thousand queries; if there are doubts, an orientation as well; if all
/// normals look inward, some hundred thousand queries.
bool areSignsWrong(const PreparedPoints& prepared, const NeighborSearch& search, const Options& options, Report& report,
                   Execution& execution);

/// Whether the normals tell that a sensor was at the origin: all but one in 1,000 look at it. Half of the normals of a
/// closed surface would look away from it. An origin more than 100 diagonals away, as a survey's, does not count.
/// \param offset position + offset is in the cloud's frame
bool isSeenFromOrigin(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals,
                      const Eigen::Vector3d& offset, Execution& execution);

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// Whether the signs of normals that came with a cloud can be meant (ours).
#pragma once

#include "points/preprocessing.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/report.h>

#include <Eigen/Core>

#include <vector>

namespace pcl::mrf {

/// True, with a warning, if the signs of the given normals are errors: a quarter of the neighbors on smooth surface are
/// opposed; or the points enclose a volume, no sensor is known, and more than a tenth of the normals look into it. Of
/// a room all do, which is told by what stands in it. See src/method.md. \param search holds the points. Cost: some
/// thousand queries; where there are doubts, an orientation, and where all look inward some hundred thousand queries.
bool areSignsWrong(const PreparedPoints& prepared, const NeighborSearch& search, const Options& options, Report& report,
                   Execution& execution);

/// Whether normals tell that a sensor was at the origin, which nobody named: of a surface that encloses something, half
/// of them would look away. The origin of a survey's coordinates is too far for that. \param offset of the positions
bool isSeenFromOrigin(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals,
                      const Eigen::Vector3d& offset, Execution& execution);

} // namespace pcl::mrf

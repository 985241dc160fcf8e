// SPDX-License-Identifier: BSD-3-Clause
/// The last step to oriented points: chooses the vote on the normals' signs, and reports it.
#pragma once

#include "points/preprocessing.h"

namespace pcl::mrf {

/// Orients the normals, by sensors or reference normals if there are any, and drops small components. The report
/// receives the vote, its result, and warnings. \param search holds the points, and afterwards those that are left
/// \throw InvalidInput if too few points are left \throw InvalidOption if noise by range is given without a sensor
OrientedPoints orientPoints(PreparedPoints prepared, const Options& options, NeighborSearch& search, Report& report,
                            Execution& execution);

/// Replaces the normals by ones that are fitted in neighborhoods as wide as the points' deviations ask for, if the
/// present normals scatter around those. They are oriented by the same vote; without a vote, by the present normals. A
/// warning tells if the cloud's own normals were replaced. \pre points.deviations are set
void fitNormalsToNoise(OrientedPoints& points, const Options& options, NeighborSearch& search, Report& report,
                       Execution& execution);

} // namespace pcl::mrf

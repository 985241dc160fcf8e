// SPDX-License-Identifier: BSD-3-Clause
/// The last step to oriented points: who votes on the normals' signs, and what is said about it.
#pragma once

#include "points/preprocessing.h"

namespace pcl::mrf {

/// Orients the normals, by sensors or reference normals if there are any, and drops small components. The report gets
/// the vote, what it came to, and warnings. \param search holds the points, and in the end those that are left
/// \throw InvalidInput if too few points are left
OrientedPoints orientPoints(PreparedPoints prepared, const Options& options, NeighborSearch& search, Report& report,
                            Execution& execution);

/// Fits normals again, in neighborhoods as wide as the points' deviations ask for, if those there are scatter around
/// such fits, and orients them as before; without a vote these have one. A cloud's own are replaced with a warning.
/// \pre points.deviations are set
void fitNormalsToNoise(OrientedPoints& points, const Options& options, NeighborSearch& search, Report& report,
                       Execution& execution);

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// Tells whether the signs of the normals that came with a cloud are plausible, and the spacing of its points (ours).
#pragma once

#include "points/preprocessing.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/report.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// What is to be done with the signs of given normals.
enum class GivenSigns : std::uint8_t {
  right,        ///< they stay
  wrong,        ///< they are found anew, as those of estimated normals are
  mostlyInward, ///< the same, but the surface is seen from within, as most of its normals tell
  ofAxis        ///< they are found anew for each piece of surface, with the side that most of its normals have
};

/// Judges the given normals' signs. They are errors, with a warning, if
/// - a quarter of the neighbors on smooth surface have opposite signs; or no sensor is known, and
/// - the surface is open, all point to one side of an axis, also the steep ones, and some contradict the majority of
///   their smooth piece; or
/// - the points enclose a volume, and more than a tenth of the normals look into it; or
/// - all look at one place, which more than a twentieth of the points are hidden from, and more than a twentieth of the
///   normals contradicts the majority of its smooth piece: on an open surface, or one that may be seen from within.
/// In a room all normals look inward. Uneven spacing, and objects in it, tell it from an object. See src/method.md.
/// \param search holds the points. Cost: some thousand queries; if there are doubts, two orientations as well; if all
/// normals look inward, some hundred thousand queries.
GivenSigns judgeSigns(const PreparedPoints& prepared, const NeighborSearch& search, const Options& options,
                      Report& report, Execution& execution);

/// Whether the spacings differ as those of a scan from amid the points do: more than 2.1 times between their 5 % and
/// 95 % quantiles. Samples of a mesh, and most scans of an object from around it, have 1.4 to 1.9.
bool isUneven(const PointSet& points);

/// The share of points that can hardly be seen from outside, if that and uneven spacing tell that they were scanned
/// from within what they enclose; else 0. The points of an object in a room are hidden behind its walls. Those in a
/// bore are hidden as well, but sparse.
/// \param search holds the points \param normals that point out of what the points enclose
double hiddenOutside(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const NeighborSearch& search);

/// Whether the normals tell that a sensor was at the origin: all but one in 1,000 look at it. Half of the normals of a
/// closed surface would look away from it. An origin more than 100 diagonals away, as a survey's, does not count.
/// \param offset position + offset is in the cloud's frame
bool isSeenFromOrigin(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals,
                      const Eigen::Vector3d& offset, Execution& execution);

} // namespace pcl::mrf

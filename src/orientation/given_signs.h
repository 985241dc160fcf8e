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

/// Judges the given normals' signs, see src/method.md, "Signs of given normals". If they are errors, a warning says so.
/// \param search holds the points. Cost: some thousand queries; if there are doubts, two orientations as well; if all
/// normals look inward, some hundred thousand queries.
GivenSigns judgeSigns(const PreparedPoints& prepared, const NeighborSearch& search, const Options& options,
                      Report& report, Execution& execution);

/// Whether the spacings differ as those of a scan from amid the points do: more than 2.1 times between their 5 % and
/// 95 % quantiles. Samples of a mesh, and most scans of an object from around it, have 1.4 to 1.9.
bool isUneven(const PointSet& points);

/// The share of points that can hardly be seen from outside, if that and uneven spacing tell that they were scanned
/// from within what they enclose; else 0.
/// \param search holds the points \param normals that point out of what the points enclose
double hiddenOutside(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const NeighborSearch& search);

/// Whether the normals tell that a sensor was at the origin: all but one in 1,000 look at it. Half of the normals of a
/// closed surface would look away from it. An origin more than 100 diagonals away, as a survey's, does not count.
/// \param offset position + offset is in the cloud's frame
bool isSeenFromOrigin(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals,
                      const Eigen::Vector3d& offset, Execution& execution);

} // namespace pcl::mrf

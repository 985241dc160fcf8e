// SPDX-License-Identifier: BSD-3-Clause
/// Normals by principal component analysis, and the paper's noise criteria on it (paper Sec. 3.1).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/point_set.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// One entry per point.
struct NormalEstimates {
  std::vector<Eigen::Vector3f> normals; ///< unit length, sign arbitrary; zero where no plane could be fitted
  std::vector<std::uint8_t> isNoise;    ///< by the paper's criteria; all 0 unless noiseCriteria is set
};

/// The radius of all points' neighborhoods, cloud's unit; 0: each point has its own neighborhood.
float resolvedRadius(const NormalOptions& options, float spacing);

/// Fits a plane to the neighbors of each point in double precision: its 13 nearest points, and more where these are
/// rough, nearly on a line, or noisy. With a radius, pcl::NormalEstimationOMP fits the planes. See src/method.md.
/// \param spacing l̄, for the paper's automatic lengths \param search holds exactly points.positions
/// \param noise σ of all points, cloud's unit, used if points.deviations is empty; 0 = unknown. Not used with a radius
/// \param asked indices of the points whose normals are estimated; empty: all. Not used with a radius
/// Cost: one or two neighbor queries per point, up to a dozen where a neighborhood has to grow. The result does not
/// depend on the number of threads; where neighborhoods grow, it depends on the order of the points.
NormalEstimates estimateNormals(const PointArrays& points, const NeighborSearch& search, float spacing,
                                const NormalOptions& options, Execution& execution, float noise = 0,
                                const std::vector<std::uint32_t>& asked = {});

} // namespace pcl::mrf

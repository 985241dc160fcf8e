// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Clouds like those that scanners deliver: open, uneven, cluttered; with points withheld from them.
#pragma once

#include "experiment.h"

#include "scan/sampling.h"

#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/reconstruction.h>

#include <functional>
#include <string>
#include <vector>

namespace mrf_apps {

/// What a method is given, and what was kept from it.
struct RealCloud {
  pcl::mrf::scan::Points input;         ///< with normals
  std::vector<Eigen::Vector3d> discs;   ///< withheld: in balls with radii of 5 to 10 local spacings
  std::vector<Eigen::Vector3d> random;  ///< withheld: a random tenth
  std::vector<Eigen::Vector3d> sensors; ///< empty: not known
  bool isWithheldNoisy = false;         ///< as the input is; false: what is withheld is the truth
};

/// Runs all stages on the input. \param hasNormals false: they are estimated and turned to the sensor
pcl::mrf::Reconstruction reconstruct(const RealCloud& cloud, bool hasNormals, const pcl::mrf::Options& options,
                                     pcl::mrf::Execution& execution);

/// Withholds the points in about 16 balls that are apart from each other, about random points, and a random tenth of
/// the others. \param truth the points without noise, which are what is withheld; as many as `points`
RealCloud withhold(const pcl::mrf::scan::Points& points, const std::vector<Eigen::Vector3d>& truth, std::uint64_t seed,
                   pcl::mrf::Execution& execution);

/// A cloud that is made or read when it is first asked for.
struct RealCase {
  std::string id, title;
  bool hasOneSensor; ///< known without loading
  std::function<const RealCloud&()> load;
  std::function<PictureOptions(const RealCloud&)> view; ///< of its surfaces: from the sensor, if one is known
};

/// Every folder of options.data/real with an input.ply that has normals; its heldout.ply, heldout_random.ply and
/// sensors.txt are read if they are there, without the former two points are withheld as above.
std::vector<RealCase> measuredClouds(const ExperimentOptions& options, pcl::mrf::Execution& execution);

/// Objects on a table before a wall, terrain from the air, a street around a lidar, objects from one side: scanned with
/// noise by rays on a regular angular grid. Quick: the table, with fewer points.
std::vector<RealCase> simulatedClouds(const ExperimentOptions& options, pcl::mrf::Execution& execution);

/// Both, those that were measured first.
std::vector<RealCase> realClouds(const ExperimentOptions& options, pcl::mrf::Execution& execution);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What goes wrong in a scan: each function changes Scan::cloud, by its own stream of the seed.
#pragma once

#include "scan.h"

namespace pcl::mrf::scan {

/// Streams of the seed; sampling has number 1.
enum Stream : std::uint64_t { cutting = 3, noising, misaligning, lying, shuffling, missing, matching };

/// \throw InvalidOption
void require(bool holds, const std::string& message);

/// Moves each point, along its normal, its line of sight or in any direction, as its device does. \param object in the
/// cloud's frame
void addNoise(const ScanOptions& options, const Box& object, Scan& scan);

/// Of the cloud, by the plane through 16 points, turned to the sensor that saw the point, or to the true side.
void estimateNormals(Scan& scan, Execution& execution);

/// Moves each view and its sensor together. \param middle that views are turned about
void misalign(const ScanOptions& options, const Eigen::Vector3d& middle, Scan& scan);

/// Appends points that are no surface: spread in the box, and in clusters like false matches.
void addOutliers(const ScanOptions& options, Scan& scan);

} // namespace pcl::mrf::scan

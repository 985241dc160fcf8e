// SPDX-License-Identifier: BSD-3-Clause
/// The errors of a scan, each with its own stream of the seed: what devices miss, mix up and measure wrongly, noise,
/// misalignment and outliers.
#pragma once

#include "random.h"
#include "scan.h"

#include <array>

namespace pcl::mrf::scan {

/// Streams of the seed; sampling has number 1.
enum Stream : std::uint64_t { cutting = 3, noising, misaligning, lying, shuffling, missing, matching };

/// \throw InvalidOption
void require(bool holds, const std::string& message);

/// A Gaussian random field of mean 0 and variance 1 whose covariance at a distance d is exp(−½ (d/length)²): waves of
/// random frequencies (Rahimi and Recht 2007).
class SmoothField {
public:
  SmoothField(double length, Random& random);
  double operator()(const Eigen::Vector3d& x) const;

private:
  struct Wave {
    Eigen::Vector3d frequency; ///< turns per length
    double phase;              ///< turns
  };
  std::array<Wave, 128> waves_;
};

/// Removes the points that the device does not measure. \return false points between surfaces. A beam has a footprint;
/// where the footprint meets a second surface,
/// - a lidar measures the mean range, which makes a false point if it is off by more than the footprint's width;
/// - a depth camera measures something between the two, in three of ten pixels;
/// - structured light measures nothing, as where part of the footprint meets nothing.
/// Photogrammetry finds nothing on a tenth of the surface, in places some fifteen spacings wide, for lack of texture.
/// \param sensors, points in the surface's frame \param spacing of the points
Points applyFootprints(const Surface& surface, const std::vector<Eigen::Vector3d>& sensors, const ScanOptions& options,
                       double spacing, Execution& execution, Points& points);

/// Moves each point along its line of sight with the noise of the device; for photogrammetry and without a device along
/// its normal. \param object in the cloud's frame
void addNoise(const ScanOptions& options, const Box& object, Scan& scan);

/// Estimates the cloud's normals by planes through 16 points. They face the sensor of the point, or the true side.
void estimateNormals(Scan& scan, Execution& execution);

/// Moves each view and its sensor together. \param middle about which views are turned
void misalign(const ScanOptions& options, const Eigen::Vector3d& middle, Scan& scan);

/// Appends points that are not on the surface: spread in the box, and in clusters like false matches.
void addOutliers(const ScanOptions& options, Scan& scan);

} // namespace pcl::mrf::scan

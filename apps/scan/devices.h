// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What kinds of devices miss, mix up and measure wrongly.
#pragma once

#include "random.h"
#include "scan.h"

#include <array>

namespace pcl::mrf::scan {

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

/// Takes away what the device does not measure. \return points between surfaces, that belong to none: a beam is as wide
/// as its footprint, and where that meets a second surface,
/// - a lidar measures the mean range, if it is off by more than the footprint's width;
/// - a depth camera, in three of ten pixels, something between the two;
/// - structured light is lost, as it is where part of the footprint meets nothing.
/// Photogrammetry finds nothing on a tenth of the surface, in places some fifteen spacings wide, for lack of texture.
/// \param sensors, points in the surface's frame \param spacing of the points
Points applyFootprints(const Surface& surface, const std::vector<Eigen::Vector3d>& sensors, const ScanOptions& options,
                       double spacing, Execution& execution, Points& points);

/// A depth camera's: the disparity, focal length · baseline / depth pixels, has an error with a deviation of .08 pixels
/// and a correlation of exp(−½ (d/3 px)²) in the image, and is rounded to eighths of a pixel. \param object in the
/// cloud's frame
void addDisparityErrors(const ScanOptions& options, const Box& object, Scan& scan);

/// Photogrammetry's, along the normal: bumps with lengths of 4 and 12 spacings that share the variance, and white noise
/// of a quarter of the deviation. \param sigma cloud's unit
void addBumps(const ScanOptions& options, double sigma, Scan& scan);

} // namespace pcl::mrf::scan

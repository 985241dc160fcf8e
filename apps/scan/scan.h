// SPDX-License-Identifier: BSD-3-Clause
/// A simulated range scan of a surface: the points that sensors measure, with their errors, and the true points.
#pragma once

#include "sampling.h"

#include <pcl/surface/mrf/execution.h>

#include <cstdint>
#include <string>
#include <vector>

namespace pcl::mrf::scan {

/// A length in a unit that can be given before the object is known.
struct Length {
  enum class Unit { cloud, diagonalPercent, spacings };
  double value = 0;
  Unit unit = Unit::cloud;
};

/// "0.5" (the cloud's unit), "2%" (of the object's diagonal) or "0.5s" (mean spacings).
/// \return false if the text is none of these, or negative
bool parseLength(const std::string& text, Length& length);

/// The kind of scanner, with its errors, see error_model.h; none: only the noise that was asked for.
enum class Device { none, depthCamera, lidar, structuredLight, photogrammetry };

struct ScanOptions;

/// Sets the sampling, the noise and the false matches that a device usually has. Depth camera: errors of the disparity
/// alone; lidar and structured light: .2 spacings; photogrammetry: bumps of one spacing and 1 % of false matches.
void adopt(Device device, ScanOptions& options);

/// Every stage draws from its own stream of the seed: changing the noise does not move points and holes.
struct ScanOptions {
  SamplingOptions sampling;
  ViewOptions views;
  std::vector<Eigen::Vector3d> sensors; ///< given sensors, used instead of views
  /// Rotation of the object about the origin: degrees about x, then y, then z.
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();

  Device device = Device::none; ///< all but none need sensors
  double baseline = .075;       ///< of a depth camera, in the cloud's unit, > 0
  Length noise;                 ///< standard deviation of each point, see addNoise
  double misalignmentAngle = 0; ///< degrees, standard deviation per axis and view, 0 to 180
  Length misalignmentShift;     ///< standard deviation per axis and view

  double uniformOutliers = 0; ///< % of all points of the cloud; the two together below 100
  double clusteredOutliers = 0;
  bool areNormalsEstimated = false; ///< of the cloud, instead of exact

  int holes = 0;                            ///< number of holes at random points of the surface, apart from each other
  std::vector<Eigen::Vector3d> holeCenters; ///< more holes, in the cloud's frame
  Length smallestHole{7, Length::Unit::diagonalPercent}, largestHole{7, Length::Unit::diagonalPercent}; ///< radii

  std::uint64_t seed = 1;
};

struct Hole {
  Eigen::Vector3d center;
  double radius;
  std::int64_t points; ///< that it removed
  bool holds(const Eigen::Vector3d& x) const { return (x - center).squaredNorm() < radius * radius; }
};

struct Scan {
  Points cloud;                         ///< as scanned, shuffled
  Points clean;                         ///< the inliers of the cloud in their order, without noise and misalignment
  Points heldOut;                       ///< the points that holes removed, without noise and misalignment
  std::vector<Eigen::Vector3d> sensors; ///< as the scanner knows them: moved with the misalignment of their view
  std::vector<Hole> holes;
  std::int64_t outliers = 0; ///< including those between surfaces
  double diagonal = 0;       ///< of the object before it is rotated: 100 %
  double spacing = 0;        ///< mean distance to the closest other point before holes and noise
  double visibleArea = 0;    ///< before holes

  double inCloudUnit(const Length& length) const;
  bool isInHole(const Eigen::Vector3d& x) const;
};

/// Simulates a scan of a surface from sensors (sampling.h) with errors (error_model.h): samples the surface, leaves out
/// what the device misses, cuts holes, adds noise, misalignment and outliers, and shuffles.
///
/// Holes are balls: they remove the points of all sheets inside, judged by the true places, and no outlier falls into
/// them. Normals are those of the surface, turned with their view; the normal of an outlier is random and faces its
/// sensor.
/// \throw InvalidOption naming what is out of range
/// \throw InvalidInput if nothing is seen or the holes leave nothing
/// The same bytes for the same options, for any number of threads.
Scan simulateScan(const Surface& surface, const ScanOptions& options, Execution& execution);

} // namespace pcl::mrf::scan

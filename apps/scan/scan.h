// SPDX-License-Identifier: BSD-3-Clause
/// A simulated range scan of a surface: what the sensors see, with their errors, and the truth beside it.
#pragma once

#include "sampling.h"

#include <pcl/surface/mrf/execution.h>

#include <cstdint>
#include <string>
#include <vector>

namespace pcl::mrf::scan {

/// A length in one of the units that make sense before the object is known.
struct Length {
  enum class Unit { cloud, diagonalPercent, spacings };
  double value = 0;
  Unit unit = Unit::cloud;
};

/// "0.5" (the cloud's unit), "2%" (of the object's diagonal) or "0.5s" (mean spacings).
/// \return false if the text is none of these, or negative
bool parseLength(const std::string& text, Length& length);

/// What scans, with the errors of its kind; see error_model.h.
enum class Device {
  none,            ///< noise as it is asked for
  depthCamera,     ///< errors of the disparity: they grow with the square of the depth, in steps and patches of pixels
  lidar,           ///< noise along the ray, a beam that may meet two surfaces
  structuredLight, ///< noise over the cosine of the angle of incidence, nothing at edges
  photogrammetry   ///< noise as smooth bumps, nothing where texture is missing
};

struct ScanOptions;

/// Sets the sampling, the noise and the false matches that a device usually has: disparities alone; .2 spacings along
/// the ray; bumps of a spacing, and 1 % of false matches.
void adopt(Device device, ScanOptions& options);

/// Every stage draws from its own stream of the seed: changing the noise leaves points and holes where they are.
struct ScanOptions {
  SamplingOptions sampling;
  ViewOptions views;
  std::vector<Eigen::Vector3d> sensors; ///< given ones, instead of views
  /// Degrees about x, then y, then z, of the object about the origin.
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();

  Device device = Device::none; ///< others than none need sensors
  double baseline = .075;       ///< of a depth camera, cloud's unit, > 0
  Length noise;                 ///< standard deviation of each point, see addNoise
  double misalignmentAngle = 0; ///< degrees, standard deviation per axis and view, 0 to 180
  Length misalignmentShift;     ///< standard deviation per axis and view

  double uniformOutliers = 0; ///< % of all points of the cloud; both together below 100
  double clusteredOutliers = 0;
  bool areNormalsEstimated = false; ///< of the cloud, instead of exact

  int holes = 0;                            ///< at random points of the surface, apart from each other
  std::vector<Eigen::Vector3d> holeCenters; ///< more holes, in the cloud's frame
  Length smallestHole{7, Length::Unit::diagonalPercent}, largestHole{7, Length::Unit::diagonalPercent}; ///< radii

  std::uint64_t seed = 1;
};

struct Hole {
  Eigen::Vector3d center;
  double radius;
  std::int64_t points; ///< it took away
  bool holds(const Eigen::Vector3d& x) const { return (x - center).squaredNorm() < radius * radius; }
};

struct Scan {
  Points cloud;                         ///< as scanned, shuffled
  Points clean;                         ///< its inliers in their order, without noise and misalignment
  Points heldOut;                       ///< what the holes took away, without noise and misalignment
  std::vector<Eigen::Vector3d> sensors; ///< as far as the scanner knows: moved with their view's misalignment
  std::vector<Hole> holes;
  std::int64_t outliers = 0; ///< with those between surfaces
  Points between;            ///< of these, until they are in the cloud
  double diagonal = 0;       ///< of the object before it is rotated: what % refers to
  double spacing = 0;        ///< mean distance to the closest other point before holes and noise
  double visibleArea = 0;    ///< before holes

  double inCloudUnit(const Length& length) const;
  bool isInHole(const Eigen::Vector3d& x) const;
};

/// A scan is a surface, seen from the sensors (sampling.h), with errors (error_model.h): samples the
/// surface, leaves out what the device misses, makes holes, adds noise, misalignment and outliers, and shuffles.
///
/// Holes are balls about their centers: they take the points of all sheets inside, by the points' true places, and no
/// outlier falls into them. Normals are those of the surface, turned with their view; an outlier's is random and faces
/// its sensor.
/// \throw InvalidOption naming what is out of range
/// \throw InvalidInput if nothing is seen or the holes leave nothing
/// The same bytes for the same options, for any number of threads.
Scan simulateScan(const Surface& surface, const ScanOptions& options, Execution& execution);

} // namespace pcl::mrf::scan

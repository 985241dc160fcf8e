// SPDX-License-Identifier: BSD-3-Clause
/// Sensors around an object, and the points of its surface that they see.
#pragma once

#include "surface.h"

#include <pcl/surface/mrf/execution.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf::scan {

/// Parallel arrays; normals or views may be empty: there are none then.
struct Points {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3d> normals;
  std::vector<std::int32_t> views; ///< index into the sensors

  std::size_t size() const { return positions.size(); }
  /// Appends point i of `other`, with the normal and the view that it has.
  void append(const Points& other, std::size_t i);
};

enum class Placement {
  sphere, ///< evenly all around, on a spiral
  ring,   ///< evenly on a circle about the axis
  front   ///< on an arc about the axis; the front direction is in its middle
};

struct ViewOptions {
  Placement placement = Placement::sphere;
  int count = 12;                                     ///< of sensors, 0 to 10000; 0: every point is seen
  double distance = 1.5;                              ///< from the object's center, in its diagonals, > 0
  double elevation = 0;                               ///< degrees above the ring or the arc, -90 to 90
  double fan = 90;                                    ///< degrees spanned by the arc of `front`, 0 to 360
  Eigen::Vector3d axis = Eigen::Vector3d(0, 1, 0);    ///< not zero
  Eigen::Vector3d forward = Eigen::Vector3d(0, 0, 1); ///< not zero; only its part across the axis counts
};

/// Sensor positions around the box's center.
/// \throw InvalidOption naming the first field that is out of range
std::vector<Eigen::Vector3d> placeSensors(const ViewOptions& options, const Box& object);

enum class Pattern {
  even,    ///< points keep a distance (Poisson discs), at the same density everywhere
  random,  ///< uniformly random, at the same density everywhere
  scanner, ///< where rays of a regular angular grid from each sensor first meet the surface; see scanWithRays
  camera   ///< the same through the pixels of an image
};

struct SamplingOptions {
  std::int64_t points = 30000; ///< 1 to 2^31 - 1; a scanner or camera gives about as many
  Pattern pattern = Pattern::even;
  double grazingLimit = 80; ///< degrees between normal and line of sight, above 0 and at most 90

  // Of a scanner, and of a camera.
  double focalLength = 580; ///< of a camera, in pixels of an image of 640 × 480; gives the field of view; > 0
  double aspect = 1;        ///< step between rows divided by the step in a row, .01 to 100
  double lowestElevation = -90, highestElevation = 90; ///< of the rows, degrees, the lower one first
  Eigen::Vector3d axis = Eigen::Vector3d(0, 1, 0);     ///< up of the device; not zero
  Eigen::Vector3d forward = Eigen::Vector3d(0, 0, 1);  ///< where a device inside looks, a scanner level
};

struct Samples {
  Points points;
  double visibleArea = 0; ///< estimated from some ten thousand draws
  double spacing = 0;     ///< mean distance to the closest other point
};

/// Points spread over the surface that at least one sensor sees, each with one of the sensors that see it.
///
/// Unless a scanner or camera samples, the density is the same everywhere on the visible surface. Even: a point is
/// taken only if it keeps a distance to all points taken before it that face the same side. The distance shrinks when
/// places run out, so that the count is always reached. The order of the points carries no meaning. Without sensors the
/// whole surface is visible. \throw InvalidInput if next to nothing of the surface is seen \throw InvalidOption also
/// for a scanner without sensors. Cost: about 10 draws and 1 to 2 lines of sight per point, 120 bytes per point. The
/// result does not depend on the number of threads.
Samples sampleSurface(const Surface& surface, const std::vector<Eigen::Vector3d>& sensors,
                      const SamplingOptions& options, std::uint64_t seed, Execution& execution);

/// Points where the rays of each sensor first meet the surface, as a depth camera or a lidar measures them: their
/// density falls with the square of the distance and with the angle of incidence.
///
/// Rays are spaced regularly in azimuth and elevation about the sensor's axis, with SamplingOptions::aspect times the
/// horizontal step between the rows. A sensor inside the sphere around the object's box is level and turns once around;
/// one outside looks at the middle of the box. The rays of a camera are spaced regularly in the plane of its image. It
/// looks where a scanner would; inside the sphere it looks straight forward. All sensors have the same steps, which are
/// chosen so that about SamplingOptions::points rays meet the surface: within a few per cent, because only whole rows
/// are added or removed. \param seed shifts the grid of each sensor by a part of a step \throw InvalidInput if next to
/// no ray meets the surface
/// Cost: some ten rays per point. The result does not depend on the number of threads.
Points scanWithRays(const Surface& surface, const std::vector<Eigen::Vector3d>& sensors, const SamplingOptions& options,
                    std::uint64_t seed, Execution& execution);

/// The frame of a scanner or camera: forward, left and up as columns.
Eigen::Matrix3d viewingFrame(const Eigen::Vector3d& sensor, const Box& object, const SamplingOptions& options);

} // namespace pcl::mrf::scan

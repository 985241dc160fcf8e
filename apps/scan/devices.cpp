// SPDX-License-Identifier: BSD-3-Clause
#include "devices.h"

#include "error_model.h"
#include "random.h"
#include "rotation.h"
#include "scanner.h"

#include <algorithm>
#include <cmath>

namespace pcl::mrf::scan {

using Eigen::Vector3d;

namespace {

constexpr double disparityNoise = .08, disparityStep = 1. / 8, disparityLength = 3; ///< pixels
constexpr double flyingShare = .3;                                                  ///< of the pixels at edges
constexpr double textureLength = 15;                                                ///< spacings
constexpr double textureLimit = 1.2816; ///< a normal deviate is above it in a tenth of all cases

/// Of the cone, radians.
double footprintOf(const ScanOptions& options)
{
  switch (options.device) {
  case Device::lidar:
    return .003;
  case Device::depthCamera:
  case Device::structuredLight:
    return 4 / options.sampling.focalLength; // the pixels that are matched at a time
  default:
    return 0;
  }
}

/// What rays around the middle one of a footprint meet.
struct Footprint {
  static constexpr int rays = 8;
  int others = 0, misses = 0; ///< of the rays: those that meet another surface, and nothing
  double otherRange = 0;      ///< mean of the others
  bool isAtEdge() const { return others + misses > 0; }
};

/// \param width of the cone, radians \param turn of the rays' pattern
Footprint footprintAt(const Surface& surface, const Vector3d& sensor, const Vector3d& position, const Vector3d& normal,
                      double width, double turn)
{
  const double range = (position - sensor).norm(), goldenTurn = 2 / (3 + std::sqrt(5.));
  const Vector3d middle = (position - sensor) / range, x = perpendicular(middle), y = middle.cross(x);
  Footprint result;
  for (int ray = 0; ray < Footprint::rays; ++ray) {
    const double radius = .5 * width * std::sqrt((ray + .5) / Footprint::rays);
    const SinCos around = sinCos(turn + ray * goldenTurn);
    const Vector3d direction = (middle + radius * (around.cosine * x + around.sine * y)).normalized();
    SurfacePoint hit;
    if (!surface.firstHit(sensor, direction, hit)) {
      ++result.misses;
      continue;
    }
    // Beside the plane through the middle's point; folds and curvature stay within a few widths.
    const double plane = normal.dot(position - sensor) / normal.dot(direction);
    const double found = (hit.position - sensor).norm();
    if (std::abs(found - plane) > 5 * width * range) {
      ++result.others;
      result.otherRange += found;
    }
  }
  result.otherRange /= std::max(1, result.others);
  return result;
}

} // namespace

SmoothField::SmoothField(double length, Random& random)
{
  for (Wave& wave : waves_) {
    wave.frequency = random.normalVector() / (2 * pi * length);
    wave.phase = random.uniform();
  }
}

double SmoothField::operator()(const Vector3d& x) const
{
  double sum = 0;
  for (const Wave& wave : waves_)
    sum += std::cos(2 * pi * (wave.frequency.dot(x) + wave.phase));
  return sum * std::sqrt(2. / static_cast<double>(waves_.size()));
}

Points applyFootprints(const Surface& surface, const std::vector<Vector3d>& sensors, const ScanOptions& options,
                       double spacing, Execution& execution, Points& points)
{
  Random random(options.seed, missing);
  const double width = footprintOf(options);
  const bool hasTexture = options.device == Device::photogrammetry;
  if (width == 0 && !hasTexture)
    return {};
  const SmoothField texture(textureLength * spacing, random);
  // Three numbers for each point, whatever becomes of it.
  std::vector<Vector3d> draws(points.size());
  for (Vector3d& draw : draws)
    draw = {random.uniform(), random.uniform(), random.uniform()};
  std::vector<Footprint> footprints(points.size());
  std::vector<double> textures(points.size());
  execution.forRange(static_cast<std::int64_t>(points.size()), 256, [&](std::int64_t begin, std::int64_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      if (hasTexture)
        textures[i] = texture(points.positions[i]);
      else
        footprints[i] =
            footprintAt(surface, sensors[points.views[i]], points.positions[i], points.normals[i], width, draws[i][0]);
    }
  });
  Points kept, between;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Footprint& found = footprints[i];
    const Vector3d &sensor = hasTexture ? points.positions[i] : sensors[points.views[i]],
                   ray = points.positions[i] - sensor;
    double share = 0; // of the way to the other surface
    if (options.device == Device::lidar)
      share = found.others / (1. + Footprint::rays - found.misses);
    else if (options.device == Device::depthCamera && draws[i][1] < flyingShare)
      share = draws[i][2];
    if (textures[i] > textureLimit || (options.device == Device::structuredLight && found.isAtEdge()))
      continue;
    const double range = ray.norm(), shift = found.others > 0 ? share * (found.otherRange - range) : 0;
    if (std::abs(shift) <= width * range) {
      kept.append(points, i);
      continue;
    }
    between.append(points, i);
    between.positions.back() += shift / range * ray;
  }
  points = std::move(kept);
  return between;
}

void addDisparityErrors(const ScanOptions& options, const Box& object, Scan& scan)
{
  Random random(options.seed, matching);
  const SmoothField error(disparityLength, random);
  SamplingOptions sampling = options.sampling;
  sampling.axis = options.views.axis;
  sampling.forward = options.views.forward;
  std::vector<Eigen::Matrix3d> frames;
  for (const Vector3d& sensor : scan.sensors)
    frames.push_back(viewingFrame(sensor, object, sampling));
  const double focal = sampling.focalLength;
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    const std::int32_t view = scan.cloud.views[i];
    Vector3d& position = scan.cloud.positions[i];
    const Vector3d ray = position - scan.sensors[view], seen = frames[view].transpose() * ray;
    // Images far apart in the field are independent of each other.
    const Vector3d pixel(focal * seen[1] / seen[0], focal * seen[2] / seen[0], 1e3 * view);
    const double disparity = focal * options.baseline / seen[0];
    const double measured = std::round((disparity + disparityNoise * error(pixel)) / disparityStep) * disparityStep;
    position = scan.sensors[view] + disparity / std::max(measured, disparityStep) * ray;
  }
}

void addBumps(const ScanOptions& options, double sigma, Scan& scan)
{
  Random random(options.seed, matching);
  const SmoothField small(4 * scan.spacing, random), wide(12 * scan.spacing, random);
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    Vector3d& position = scan.cloud.positions[i];
    const double bump = std::sqrt(.5) * (small(position) + wide(position));
    position += sigma * (bump + .25 * random.normal()) * scan.cloud.normals[i];
  }
}

} // namespace pcl::mrf::scan

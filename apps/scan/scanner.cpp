// SPDX-License-Identifier: BSD-3-Clause
#include "sampling.h"

#include "random.h"

#include <base/loops.h>
#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace pcl::mrf::scan {

using Eigen::Vector3d;

namespace {

/// Number of rays that measure which share of the sensors' view is surface.
constexpr double pilotRays = 40000;

/// Maximum number; if too few of them hit the object, it is too small.
constexpr double maxPilotRays = 1e6;

bool isOutside(const Vector3d& sensor, const Box& object)
{
  return (object.center() - sensor).norm() > .5 * object.diagonal().norm();
}

/// The view of a sensor. Angles are in full turns; for a camera they are places in its image, in focal lengths.
struct Head {
  Vector3d position;
  Eigen::Matrix3d frame; ///< forward, left and up
  bool isCamera = false, turnsAround = false;
  double halfAzimuth = .5;               ///< to either side of forward
  double lowest = -.25, highest = .25;   ///< elevations
  double azimuthPhase = 0, rowPhase = 0; ///< in steps
  double area() const { return 2 * halfAzimuth * std::max(0., highest - lowest); }

  Vector3d direction(double azimuth, double elevation) const
  {
    const auto forward = frame.col(0), left = frame.col(1), up = frame.col(2);
    if (isCamera)
      return (forward + azimuth * left + elevation * up).normalized();
    const SinCos around = sinCos(azimuth), above = sinCos(elevation);
    return above.cosine * (around.cosine * forward + around.sine * left) + above.sine * up;
  }
};

/// A row of rays with one elevation.
struct Row {
  std::int32_t view;
  double elevation;
};

/// A unit vector perpendicular to both; to the first one alone if they are parallel.
Vector3d across(const Vector3d& unit, const Vector3d& other)
{
  const Vector3d product = unit.cross(other);
  return product.norm() > 1e-6 * other.norm() ? product.normalized() : perpendicular(unit);
}

Head headOf(const Vector3d& sensor, const Box& box, const SamplingOptions& options, Random& random)
{
  Head head;
  head.position = sensor;
  head.azimuthPhase = random.uniform();
  head.rowPhase = random.uniform();
  head.frame = viewingFrame(sensor, box, options);
  head.isCamera = options.pattern == Pattern::camera;
  if (head.isCamera) {
    head.halfAzimuth = 320 / options.focalLength;
    head.highest = 240 / options.focalLength;
    head.lowest = -head.highest;
    return head;
  }
  head.turnsAround = !isOutside(sensor, box);
  if (!head.turnsAround) {
    // Not smaller than half the angle of the cone around the box's sphere: asin x ≤ (π/2) x.
    head.halfAzimuth = .125 * box.diagonal().norm() / (box.center() - sensor).norm();
    head.highest = head.halfAzimuth;
    head.lowest = -head.highest;
  }
  head.lowest = std::max(head.lowest, options.lowestElevation / 360);
  head.highest = std::min(head.highest, options.highestElevation / 360);
  return head;
}

class RayScan {
public:
  RayScan(const Surface& surface, const std::vector<Vector3d>& sensors, const SamplingOptions& options,
          std::uint64_t seed, Execution& execution)
      : surface_(surface), options_(options), execution_(execution), box_(surface.boundingBox()),
        lowestCosine_(sinCos(options.grazingLimit / 360).cosine)
  {
    Random random(seed, 1);
    for (const Vector3d& sensor : sensors)
      heads_.push_back(headOf(sensor, box_, options, random));
  }

  Points run()
  {
    const auto wanted = static_cast<double>(options_.points);
    double step = pilotStep();
    Points best;
    double minError = std::numeric_limits<double>::infinity();
    for (int pass = 0; pass < 4 && minError > .01; ++pass) {
      Points points = scan(step);
      if (points.positions.empty())
        throw InvalidInput(nothingIsHit);
      const double share = static_cast<double>(points.size()) / wanted;
      // Whole rows are added or removed when the step changes, so that a later pass may be worse.
      if (std::abs(share - 1) < minError) {
        minError = std::abs(share - 1);
        best = std::move(points);
      }
      step *= std::sqrt(share);
    }
    return best;
  }

private:
  /// The step at which about as many rays as points are wanted meet the surface.
  double pilotStep()
  {
    double area = 0;
    for (const Head& head : heads_)
      area += head.area();
    for (double rays = pilotRays; area > 0 && rays <= maxPilotRays; rays *= 5) {
      const double step = std::sqrt(area / (rays * options_.aspect));
      const auto hits = static_cast<double>(scan(step).size());
      if (hits >= 400)
        return step * std::sqrt(hits / static_cast<double>(options_.points));
    }
    throw InvalidInput(nothingIsHit);
  }

  std::vector<Row> rows(double step) const
  {
    std::vector<Row> result;
    for (std::size_t view = 0; view < heads_.size(); ++view) {
      const Head& head = heads_[view];
      for (std::int64_t row = 0;; ++row) {
        const double elevation = head.lowest + (static_cast<double>(row) + head.rowPhase) * options_.aspect * step;
        if (!(elevation < head.highest))
          break;
        result.push_back({static_cast<std::int32_t>(view), elevation});
      }
    }
    return result;
  }

  Points scan(double step)
  {
    const std::vector<Row> all = rows(step);
    std::vector<Points> found(all.size());
    forEach(execution_, static_cast<std::int64_t>(all.size()), 4,
            [&](std::size_t i) { scanRow(all[i], step, found[i]); });
    Points points;
    for (const Points& row : found)
      for (std::size_t i = 0; i < row.size(); ++i)
        points.append(row, i);
    return points;
  }

  void scanRow(const Row& row, double step, Points& points) const
  {
    const Head& head = heads_[row.view];
    // A row that turns around has a whole number of steps, to close without a seam.
    const auto columns = static_cast<std::int64_t>(std::ceil(2 * head.halfAzimuth / step));
    const double columnStep = head.turnsAround ? 1 / static_cast<double>(columns) : step;
    for (std::int64_t column = 0; column < columns; ++column) {
      const double azimuth = (static_cast<double>(column) + head.azimuthPhase) * columnStep - head.halfAzimuth;
      if (head.isCamera && azimuth > head.halfAzimuth)
        break;
      addHit(head, row.view, head.direction(azimuth, row.elevation), points);
    }
  }

  void addHit(const Head& head, std::int32_t view, const Vector3d& direction, Points& points) const
  {
    SurfacePoint point;
    if (!surface_.firstHit(head.position, direction, point))
      return;
    const double cosine = -point.normal.dot(direction);
    if (!(cosine > 0 && cosine >= lowestCosine_))
      return;
    points.positions.push_back(point.position);
    points.normals.push_back(point.normal);
    points.views.push_back(view);
  }

  static constexpr const char* nothingIsHit =
      "next to no ray of the scanner meets the surface: is the mesh inside out, are the sensors inside of the object, "
      "or do the elevations miss it?";

  const Surface& surface_;
  const SamplingOptions& options_;
  Execution& execution_;
  Box box_;
  double lowestCosine_;
  std::vector<Head> heads_;
};

} // namespace

Eigen::Matrix3d viewingFrame(const Vector3d& sensor, const Box& object, const SamplingOptions& options)
{
  Vector3d forward, left, up = options.axis.normalized();
  if (isOutside(sensor, object) || options.pattern == Pattern::camera) {
    forward = (isOutside(sensor, object) ? object.center() - sensor : options.forward).normalized();
    left = across(up, forward);
    up = forward.cross(left);
  } else {
    left = across(up, options.forward);
    forward = left.cross(up);
  }
  Eigen::Matrix3d frame;
  frame << forward, left, up;
  return frame;
}

Points scanWithRays(const Surface& surface, const std::vector<Vector3d>& sensors, const SamplingOptions& options,
                    std::uint64_t seed, Execution& execution)
{
  return RayScan(surface, sensors, options, seed, execution).run();
}

} // namespace pcl::mrf::scan

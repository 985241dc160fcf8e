// SPDX-License-Identifier: BSD-3-Clause
#include "scan.h"

#include <pcl/surface/mrf/exceptions.h>
#include <shapes/portable_math.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

namespace pcl {
namespace mrf {
namespace scan {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using portable::dot;

bool parseLength(const std::string& text, Length& length)
{
  const char *begin = text.data(), *end = begin + text.size();
  Length parsed;
  const auto result = std::from_chars(begin, end, parsed.value);
  const std::string suffix(result.ptr, end);
  if (result.ec != std::errc() || !std::isfinite(parsed.value) || parsed.value < 0)
    return false;
  if (suffix == "%")
    parsed.unit = Length::Unit::diagonalPercent;
  else if (suffix == "s")
    parsed.unit = Length::Unit::spacings;
  else if (!suffix.empty())
    return false;
  length = parsed;
  return true;
}

namespace {

/// Streams of the seed; sampling has number 1.
enum Stream : std::uint64_t { displacing = 2, cutting, noising, misaligning, lying, shuffling };

void require(bool holds, const std::string& message)
{
  if (!holds)
    throw InvalidOption(message);
}

void validate(const ScanOptions& options)
{
  const auto isShare = [](double percent) { return percent >= 0 && percent < 100; };
  require(options.rotation.allFinite(), "the rotation must be finite");
  require(options.wavelength.value > 0 && options.wavelength.unit != Length::Unit::spacings,
          "the wavelength of the displacement must be positive, in the cloud's unit or in % of the diagonal");
  require(options.displacement.unit != Length::Unit::spacings,
          "the displacement must be in the cloud's unit or in % of the diagonal: the spacing is not known yet");
  require(options.misalignmentAngle >= 0 && options.misalignmentAngle <= 180,
          "the misalignment's angle must be 0 to 180 degrees");
  require(isShare(options.uniformOutliers) && isShare(options.clusteredOutliers) &&
              isShare(options.uniformOutliers + options.clusteredOutliers),
          "outliers must be 0 to below 100 % of the points");
  require(options.clusterSize >= 1 && options.clusterSize <= 1000000, "a cluster must have 1 to 1000000 points");
  require(options.holes >= 0 && options.holes <= 100000, "the number of holes must be 0 to 100000");
  for (const Vector3d& center : options.holeCenters)
    require(center.allFinite(), "the holes' centers must be finite");
  require(options.smallestHole.unit == options.largestHole.unit &&
              options.smallestHole.value <= options.largestHole.value && options.smallestHole.value > 0,
          "the holes' radii must be positive, the smaller one first, both in one unit");
  for (const Vector3d& sensor : options.sensors)
    require(sensor.allFinite(), "the sensors must be finite");
}

/// Rotation about one axis.
Matrix3d axisRotation(int axis, double degrees)
{
  const portable::SinCos angle = portable::sinCos(degrees / 360);
  const int second = (axis + 1) % 3, third = (axis + 2) % 3;
  Matrix3d rotation = Matrix3d::Identity();
  rotation(second, second) = rotation(third, third) = angle.cosine;
  rotation(third, second) = angle.sine;
  rotation(second, third) = -angle.sine;
  return rotation;
}

/// Matrix times vector, in a fixed order of operations.
Vector3d turn(const Matrix3d& rotation, const Vector3d& x)
{
  Vector3d result;
  for (int row = 0; row < 3; ++row)
    result[row] = dot(Vector3d(rotation(row, 0), rotation(row, 1), rotation(row, 2)), x);
  return result;
}

/// The object's rotation: about x, then y, then z.
Vector3d rotate(const Vector3d& degrees, Vector3d x)
{
  for (int axis = 0; axis < 3; ++axis)
    if (degrees[axis] != 0)
      x = turn(axisRotation(axis, degrees[axis]), x);
  return x;
}

Vector3d rotateBack(const Vector3d& degrees, Vector3d x)
{
  for (int axis = 2; axis >= 0; --axis)
    if (degrees[axis] != 0)
      x = turn(axisRotation(axis, -degrees[axis]), x);
  return x;
}

class Simulation {
public:
  Simulation(const Surface& surface, const ScanOptions& options, Execution& execution)
      : surface_(surface), options_(options), execution_(execution)
  {}

  Scan run()
  {
    validate(options_);
    const Box box = surface_.boundingBox();
    scan_.diagonal = box.diagonal();
    sample(box);
    cutHoles();
    scan_.cloud = scan_.clean;
    addNoise();
    misalign();
    addOutliers();
    shuffle();
    return std::move(scan_);
  }

private:
  double inCloudUnit(const Length& length) const
  {
    switch (length.unit) {
    case Length::Unit::diagonalPercent:
      return .01 * length.value * scan_.diagonal;
    case Length::Unit::spacings:
      return length.value * scan_.spacing;
    default:
      return length.value;
    }
  }

  /// Sees the object as it lies in its own frame, by sensors that are turned the other way round, so that a rotated
  /// object is sampled like the one at rest where both are seen.
  void sample(const Box& box)
  {
    scan_.sensors = options_.sensors;
    if (scan_.sensors.empty()) {
      const Vector3d half = .5 * (box.upper - box.lower), center = rotate(options_.rotation, box.center());
      scan_.sensors = placeSensors(options_.views, {center - half, center + half});
    }
    std::vector<Vector3d> seenFromObject;
    for (const Vector3d& sensor : scan_.sensors)
      seenFromObject.push_back(rotateBack(options_.rotation, sensor));

    Random random(options_.seed, displacing);
    const Displacement displacement(inCloudUnit(options_.displacement), inCloudUnit(options_.wavelength), random);
    execution_.beginStage("scanning");
    SamplingOptions sampling = options_.sampling;
    sampling.axis = rotateBack(options_.rotation, options_.views.axis);
    sampling.forward = rotateBack(options_.rotation, options_.views.forward);
    Samples samples =
        sampleSurface(surface_, seenFromObject, sampling, options_.displacement.value > 0 ? &displacement : nullptr,
                      options_.seed, execution_);
    scan_.spacing = samples.spacing;
    scan_.visibleArea = samples.visibleArea;
    scan_.clean = std::move(samples.points);
    if (options_.rotation.isZero(0))
      return;
    for (std::size_t i = 0; i < scan_.clean.size(); ++i) {
      scan_.clean.positions[i] = rotate(options_.rotation, scan_.clean.positions[i]);
      scan_.clean.normals[i] = rotate(options_.rotation, scan_.clean.normals[i]);
    }
  }

  void chooseHoles()
  {
    Random random(options_.seed, cutting);
    const double smallest = inCloudUnit(options_.smallestHole), largest = inCloudUnit(options_.largestHole);
    for (const Vector3d& center : options_.holeCenters)
      scan_.holes.push_back({center, random.uniform(smallest, largest), 0});
    const std::vector<Vector3d>& places = scan_.clean.positions;
    for (int i = 0; i < options_.holes; ++i) {
      Hole hole{Vector3d::Zero(), random.uniform(smallest, largest), 0};
      const auto isApart = [&](const Hole& other) {
        return portable::norm(other.center - hole.center) >= other.radius + hole.radius;
      };
      int tries = 0;
      do {
        require(++tries <= 10000, "only " + std::to_string(i) + " of " + std::to_string(options_.holes) +
                                      " holes find room on the object: ask for fewer or smaller ones");
        hole.center = places[random.index(places.size())];
      } while (!std::all_of(scan_.holes.begin(), scan_.holes.end(), isApart));
      scan_.holes.push_back(hole);
    }
  }

  void cutHoles()
  {
    chooseHoles();
    if (scan_.holes.empty())
      return;
    Points kept;
    for (std::size_t i = 0; i < scan_.clean.size(); ++i) {
      bool isIn = false;
      for (Hole& hole : scan_.holes)
        if (isInside(hole, scan_.clean.positions[i])) {
          ++hole.points;
          isIn = true;
        }
      (isIn ? scan_.heldOut : kept).append(scan_.clean, i);
    }
    if (kept.positions.empty())
      throw InvalidInput("the holes leave no points: ask for smaller ones");
    scan_.clean = std::move(kept);
  }

  static bool isInside(const Hole& hole, const Vector3d& x)
  {
    const Vector3d apart = x - hole.center;
    return dot(apart, apart) < hole.radius * hole.radius;
  }

  void addNoise()
  {
    const double sigma = inCloudUnit(options_.noise);
    if (sigma == 0)
      return;
    Random random(options_.seed, noising);
    Points& points = scan_.cloud;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (options_.noiseDirection == NoiseDirection::normal)
        points.positions[i] += sigma * random.normal() * points.normals[i];
      else
        points.positions[i] += sigma * random.normalVector();
    }
  }

  /// Each view and its sensor move together, about the middle of the cloud.
  void misalign()
  {
    const double shift = inCloudUnit(options_.misalignmentShift);
    if (scan_.sensors.empty() || (options_.misalignmentAngle == 0 && shift == 0))
      return;
    Random random(options_.seed, misaligning);
    const Vector3d middle = rotate(options_.rotation, surface_.boundingBox().center());
    std::vector<Vector3d> turns, shifts;
    for (std::size_t view = 0; view < scan_.sensors.size(); ++view) {
      turns.push_back(options_.misalignmentAngle * random.normalVector());
      shifts.push_back(shift * random.normalVector());
      scan_.sensors[view] = middle + rotate(turns[view], scan_.sensors[view] - middle) + shifts[view];
    }
    for (std::size_t i = 0; i < scan_.cloud.size(); ++i) {
      const auto view = static_cast<std::size_t>(scan_.cloud.views[i]);
      Vector3d& position = scan_.cloud.positions[i];
      position = middle + rotate(turns[view], position - middle) + shifts[view];
      scan_.cloud.normals[i] = rotate(turns[view], scan_.cloud.normals[i]);
    }
  }

  void addOutlier(const Vector3d& position, std::int32_t view, Random& random)
  {
    Vector3d normal = random.direction();
    if (view >= 0) {
      if (dot(normal, scan_.sensors[static_cast<std::size_t>(view)] - position) < 0)
        normal = -normal;
      scan_.cloud.views.push_back(view);
    }
    scan_.cloud.positions.push_back(position);
    scan_.cloud.normals.push_back(normal);
  }

  bool isInHole(const Vector3d& x) const
  {
    return std::any_of(scan_.holes.begin(), scan_.holes.end(), [&](const Hole& hole) { return isInside(hole, x); });
  }

  void addOutliers()
  {
    const auto inliers = static_cast<double>(scan_.cloud.size());
    const double shares = .01 * (options_.uniformOutliers + options_.clusteredOutliers);
    scan_.outliers = std::llround(inliers * shares / (1 - shares));
    if (scan_.outliers == 0)
      return;
    const auto clustered =
        std::llround(static_cast<double>(scan_.outliers) * .01 * options_.clusteredOutliers / shares);
    require(static_cast<double>(scan_.outliers) + inliers <= INT32_MAX, "that many outliers make too many points");
    Random random(options_.seed, lying);
    addUniform(scan_.outliers - clustered, random);
    addClusters(clustered, random);
  }

  void addUniform(std::int64_t count, Random& random)
  {
    const Points& truth = scan_.clean;
    Vector3d lower = truth.positions[0], upper = truth.positions[0];
    for (const Points* points : {&scan_.clean, &scan_.heldOut})
      for (const Vector3d& x : points->positions) {
        lower = lower.cwiseMin(x);
        upper = upper.cwiseMax(x);
      }
    // A flat object has no volume to spread them in.
    const Vector3d margin = Vector3d::Constant(.05 * scan_.diagonal);
    lower -= margin;
    upper += margin;
    for (std::int64_t i = 0; i < count; ++i) {
      Vector3d x;
      int tries = 0;
      do {
        require(++tries <= 10000, "the holes leave no room for outliers");
        for (int axis = 0; axis < 3; ++axis)
          x[axis] = random.uniform(lower[axis], upper[axis]);
      } while (isInHole(x));
      const std::int32_t view =
          scan_.sensors.empty() ? -1 : static_cast<std::int32_t>(random.index(scan_.sensors.size()));
      addOutlier(x, view, random);
    }
  }

  /// A false match puts a small, flat patch at a wrong depth: off the surface along the line of sight.
  void addClusters(std::int64_t count, Random& random)
  {
    const double radius = inCloudUnit(options_.clusterRadius);
    int failures = 0;
    for (std::int64_t added = 0; added < count;) {
      const std::size_t i = random.index(scan_.clean.size());
      const std::int32_t view = scan_.sensors.empty() ? -1 : scan_.clean.views[i];
      const Vector3d& surface = scan_.clean.positions[i];
      const Vector3d sight =
          view < 0 ? scan_.clean.normals[i] : portable::unit(scan_.sensors[static_cast<std::size_t>(view)] - surface);
      const double depth = (.02 + .13 * random.uniform()) * scan_.diagonal * (random.uniform() < .5 ? -1 : 1);
      const Vector3d x = portable::perpendicular(sight), y = portable::cross(sight, x);
      for (int j = 0; j < options_.clusterSize && added < count; ++j) {
        int tries = 0;
        Vector3d position;
        do {
          const double across = random.normal(), up = random.normal(), along = random.normal();
          position = surface + (depth + .3 * radius * along) * sight + radius * (across * x + up * y);
        } while (isInHole(position) && ++tries < 100);
        if (tries == 100) {
          require(++failures < 10000, "the holes leave no room for outliers");
          break;
        }
        addOutlier(position, view, random);
        ++added;
      }
    }
  }

  void shuffle()
  {
    Random random(options_.seed, shuffling);
    const std::size_t inliers = scan_.clean.size();
    std::vector<std::size_t> order(scan_.cloud.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    random.shuffle(order);
    Points cloud, clean;
    for (const std::size_t i : order) {
      cloud.append(scan_.cloud, i);
      if (i < inliers)
        clean.append(scan_.clean, i);
    }
    scan_.cloud = std::move(cloud);
    scan_.clean = std::move(clean);
  }

  const Surface& surface_;
  const ScanOptions& options_;
  Execution& execution_;
  Scan scan_;
};

} // namespace

Scan simulateScan(const Surface& surface, const ScanOptions& options, Execution& execution)
{
  return Simulation(surface, options, execution).run();
}

} // namespace scan
} // namespace mrf
} // namespace pcl

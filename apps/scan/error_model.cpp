// SPDX-License-Identifier: BSD-3-Clause
#include "error_model.h"

#include <base/loops.h>
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/neighbor_search.h>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>

namespace pcl::mrf::scan {

using Eigen::Vector3d;

void require(bool holds, const std::string& message)
{
  if (!holds)
    throw InvalidOption(message);
}

namespace {

constexpr double disparityNoise = .08, disparityStep = 1. / 8, disparityLength = 3; ///< pixels
constexpr double flyingShare = .3;                                                  ///< share of the pixels at edges
constexpr double textureLength = 15;                                                ///< spacings
constexpr double textureLimit = 1.2816; ///< a normal deviate is above it in a tenth of all cases

/// Width of the beam's cone, radians.
double footprintOf(const ScanOptions& options)
{
  if (options.device == Device::lidar)
    return .003;
  const bool isMatched = options.device == Device::depthCamera || options.device == Device::structuredLight;
  return isMatched ? 4 / options.sampling.focalLength : 0; // four pixels are matched together
}

/// What the rays of a footprint around its middle ray meet.
struct Footprint {
  static constexpr int rays = 8;
  int others = 0, misses = 0; ///< number of rays that meet another surface, and that meet nothing
  double otherRange = 0;      ///< mean range of the others
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
    // Other surface is far from the plane through the middle ray's point; folds and curvature stay within a few widths.
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

/// Adds the errors of a depth camera: the disparity, focal length · baseline / depth, in pixels, has an error with a
/// deviation of .08 pixels and a correlation of exp(−½ (d/3 px)²) in the image, and is rounded to eighths of a pixel.
/// \param object in the cloud's frame
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

/// Adds the errors of photogrammetry along the normal: bumps with lengths of 4 and 12 spacings that share the variance,
/// and white noise of a quarter of the deviation. \param sigma cloud's unit
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

void addOutlier(const Vector3d& position, std::int32_t view, Random& random, Scan& scan)
{
  Vector3d normal = random.direction();
  if (view >= 0) {
    if (normal.dot(scan.sensors[view] - position) < 0)
      normal = -normal;
    scan.cloud.views.push_back(view);
  }
  scan.cloud.positions.push_back(position);
  scan.cloud.normals.push_back(normal);
}

void addUniform(std::int64_t count, Random& random, Scan& scan)
{
  Eigen::AlignedBox3d box;
  for (const Points* points : {&scan.clean, &scan.heldOut})
    for (const Vector3d& x : points->positions)
      box.extend(x);
  // The margin gives flat objects a volume to spread the outliers in.
  const Vector3d margin = Vector3d::Constant(.05 * scan.diagonal), lower = box.min() - margin,
                 upper = box.max() + margin;
  for (std::int64_t i = 0; i < count; ++i) {
    Vector3d x;
    int tries = 0;
    do {
      require(++tries <= 10000, "the holes leave no room for outliers");
      for (int axis = 0; axis < 3; ++axis)
        x[axis] = random.uniform(lower[axis], upper[axis]);
    } while (scan.isInHole(x));
    const std::int32_t view = scan.sensors.empty() ? -1 : static_cast<std::int32_t>(random.index(scan.sensors.size()));
    addOutlier(x, view, random, scan);
  }
}

/// Adds false matches, which put a small, flat patch at a wrong depth: off the surface along the line of sight.
void addClusters(std::int64_t count, Random& random, Scan& scan)
{
  constexpr int clusterSize = 30;
  const double radius = .01 * scan.diagonal;
  int failures = 0;
  for (std::int64_t added = 0; added < count;) {
    const std::size_t i = random.index(scan.clean.size());
    const std::int32_t view = scan.sensors.empty() ? -1 : scan.clean.views[i];
    const Vector3d& surface = scan.clean.positions[i];
    const Vector3d sight = view < 0 ? scan.clean.normals[i] : Vector3d((scan.sensors[view] - surface).normalized());
    const double depth = (.02 + .13 * random.uniform()) * scan.diagonal * (random.uniform() < .5 ? -1 : 1);
    const Vector3d x = perpendicular(sight), y = sight.cross(x);
    for (int j = 0; j < clusterSize && added < count; ++j) {
      int tries = 0;
      Vector3d position;
      do {
        const double across = random.normal(), up = random.normal(), along = random.normal();
        position = surface + (depth + .3 * radius * along) * sight + radius * (across * x + up * y);
      } while (scan.isInHole(position) && ++tries < 100);
      if (tries == 100) {
        require(++failures < 10000, "the holes leave no room for outliers");
        break;
      }
      addOutlier(position, view, random, scan);
      ++added;
    }
  }
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
  // Three numbers for each point, whether they are used or not.
  std::vector<Vector3d> draws(points.size());
  for (Vector3d& draw : draws)
    draw = {random.uniform(), random.uniform(), random.uniform()};
  std::vector<Footprint> footprints(points.size());
  std::vector<double> textures(points.size());
  forEach(execution, static_cast<std::int64_t>(points.size()), 256, [&](std::size_t i) {
    if (hasTexture)
      textures[i] = texture(points.positions[i]);
    else
      footprints[i] =
          footprintAt(surface, sensors[points.views[i]], points.positions[i], points.normals[i], width, draws[i][0]);
  });
  Points kept, between;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Footprint& found = footprints[i];
    const Vector3d &sensor = hasTexture ? points.positions[i] : sensors[points.views[i]],
                   ray = points.positions[i] - sensor;
    double share = 0; // of the way to the other surface by which the point moves
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

void addNoise(const ScanOptions& options, const Box& object, Scan& scan)
{
  const double sigma = scan.inCloudUnit(options.noise);
  if (options.device == Device::photogrammetry)
    return addBumps(options, sigma, scan);
  if (options.device == Device::depthCamera)
    addDisparityErrors(options, object, scan);
  if (sigma == 0)
    return;
  Random random(options.seed, noising);
  Points& points = scan.cloud;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vector3d& position = points.positions[i];
    if (options.device == Device::none) {
      position += sigma * random.normal() * points.normals[i];
    } else {
      const Vector3d sight = (scan.sensors[points.views[i]] - position).normalized();
      const bool isLight = options.device == Device::structuredLight;
      position += sigma / (isLight ? std::max(.1, sight.dot(points.normals[i])) : 1) * random.normal() * sight;
    }
  }
}

void estimateNormals(Scan& scan, Execution& execution)
{
  Points& points = scan.cloud;
  std::vector<Eigen::Vector3f> positions;
  for (const Vector3d& x : points.positions)
    positions.push_back(((x - points.positions.front()) / scan.diagonal).cast<float>());
  const auto search = makePointBins();
  search->setPoints(positions, execution);
  execution.forRange(static_cast<std::int64_t>(points.size()), 256, [&](std::int64_t begin, std::int64_t end) {
    Neighbors found;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      Eigen::Matrix3Xd near(3, search->nearest(positions[i], 16, found));
      for (Eigen::Index j = 0; j < near.cols(); ++j)
        near.col(j) = points.positions[found.indices[j]] - points.positions[i];
      near.colwise() -= near.rowwise().mean().eval();
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(near * near.transpose());
      const Vector3d out =
          points.views.empty() ? points.normals[i] : Vector3d(scan.sensors[points.views[i]] - points.positions[i]);
      const Vector3d normal = axes.eigenvectors().col(0);
      points.normals[i] = normal.dot(out) < 0 ? Vector3d(-normal) : normal;
    }
  });
}

void misalign(const ScanOptions& options, const Vector3d& middle, Scan& scan)
{
  const double shift = scan.inCloudUnit(options.misalignmentShift);
  if (scan.sensors.empty() || (options.misalignmentAngle == 0 && shift == 0))
    return;
  Random random(options.seed, misaligning);
  std::vector<Eigen::Matrix3d> turns;
  std::vector<Vector3d> shifts;
  for (Vector3d& sensor : scan.sensors) {
    turns.push_back(rotationOf(options.misalignmentAngle * random.normalVector()));
    shifts.push_back(shift * random.normalVector());
    sensor = middle + turns.back() * (sensor - middle) + shifts.back();
  }
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    const auto view = static_cast<std::size_t>(scan.cloud.views[i]);
    Vector3d &position = scan.cloud.positions[i], &normal = scan.cloud.normals[i];
    position = middle + turns[view] * (position - middle) + shifts[view];
    normal = Vector3d(turns[view] * normal);
  }
}

void addOutliers(const ScanOptions& options, Scan& scan)
{
  const auto inliers = static_cast<double>(scan.cloud.size());
  const double shares = .01 * (options.uniformOutliers + options.clusteredOutliers);
  const std::int64_t added = std::llround(inliers * shares / (1 - shares));
  if (added == 0)
    return;
  const auto clustered = std::llround(static_cast<double>(added) * .01 * options.clusteredOutliers / shares);
  require(static_cast<double>(added) + inliers <= INT32_MAX, "that many outliers make too many points");
  scan.outliers += added;
  Random random(options.seed, lying);
  addUniform(added - clustered, random, scan);
  addClusters(clustered, random, scan);
}

} // namespace pcl::mrf::scan

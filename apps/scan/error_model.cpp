// SPDX-License-Identifier: BSD-3-Clause
#include "error_model.h"

#include "devices.h"
#include "random.h"
#include "rotation.h"

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
    if (options.noiseDirection == NoiseDirection::isotropic) {
      position += sigma * random.normalVector();
    } else if (options.noiseDirection == NoiseDirection::normal) {
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

namespace {

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
  // A flat object has no volume to spread them in.
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

/// A false match puts a small, flat patch at a wrong depth: off the surface along the line of sight.
void addClusters(const ScanOptions& options, std::int64_t count, Random& random, Scan& scan)
{
  const double radius = scan.inCloudUnit(options.clusterRadius);
  int failures = 0;
  for (std::int64_t added = 0; added < count;) {
    const std::size_t i = random.index(scan.clean.size());
    const std::int32_t view = scan.sensors.empty() ? -1 : scan.clean.views[i];
    const Vector3d& surface = scan.clean.positions[i];
    const Vector3d sight = view < 0 ? scan.clean.normals[i] : Vector3d((scan.sensors[view] - surface).normalized());
    const double depth = (.02 + .13 * random.uniform()) * scan.diagonal * (random.uniform() < .5 ? -1 : 1);
    const Vector3d x = perpendicular(sight), y = sight.cross(x);
    for (int j = 0; j < options.clusterSize && added < count; ++j) {
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
  addClusters(options, clustered, random, scan);
}

} // namespace pcl::mrf::scan

// SPDX-License-Identifier: BSD-3-Clause
#include "scan.h"

#include "error_model.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

namespace pcl::mrf::scan {

using Eigen::Vector3d;

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

/// Checks what the command line does not check for single values.
void validate(const ScanOptions& options)
{
  const auto isShare = [](double percent) { return percent >= 0 && percent < 100; };
  require(options.misalignmentAngle >= 0 && options.misalignmentAngle <= 180,
          "the misalignment's angle must be 0 to 180 degrees");
  require(isShare(options.uniformOutliers) && isShare(options.clusteredOutliers) &&
              isShare(options.uniformOutliers + options.clusteredOutliers),
          "outliers must be 0 to below 100 % of the points");
  require(options.smallestHole.unit == options.largestHole.unit &&
              options.smallestHole.value <= options.largestHole.value && options.smallestHole.value > 0,
          "the holes' radii must be positive, the smaller one first, both in one unit");
  const bool hasSensors = !options.sensors.empty() || options.views.count > 0;
  require(hasSensors || options.device == Device::none, "devices need sensors: give some");
  require(options.device != Device::depthCamera || options.sampling.pattern == Pattern::camera,
          "a depth camera samples the pixels of its image: choose the sampling of a camera");
}

/// Samples in the frame of the object, with the sensors rotated back, so that a rotated object gets the same samples as
/// an unrotated one where both are seen. \param object in the cloud's frame
/// \return the points between surfaces
Points sample(const Surface& surface, const Box& object, const ScanOptions& options, Execution& execution, Scan& scan)
{
  scan.diagonal = surface.boundingBox().diagonal().norm();
  scan.sensors = options.sensors.empty() ? placeSensors(options.views, object) : options.sensors;
  std::vector<Vector3d> seenFromObject;
  for (const Vector3d& sensor : scan.sensors)
    seenFromObject.push_back(rotateBack(options.rotation, sensor));
  SamplingOptions sampling = options.sampling;
  sampling.axis = rotateBack(options.rotation, options.views.axis);
  sampling.forward = rotateBack(options.rotation, options.views.forward);
  execution.beginStage("scanning");
  Samples samples = sampleSurface(surface, seenFromObject, sampling, options.seed, execution);
  scan.spacing = samples.spacing;
  scan.visibleArea = samples.visibleArea;
  scan.clean = std::move(samples.points);
  Points between = applyFootprints(surface, seenFromObject, options, scan.spacing, execution, scan.clean);
  if (scan.clean.positions.empty())
    throw InvalidInput("the device measures nothing: all of what it sees are edges");
  for (Points* points : {&scan.clean, &between})
    for (std::size_t i = 0; i < points->size() && !options.rotation.isZero(0); ++i) {
      points->positions[i] = rotate(options.rotation, points->positions[i]);
      points->normals[i] = rotate(options.rotation, points->normals[i]);
    }
  return between;
}

/// Adds the points between surfaces that are in no hole as outliers.
void addBetween(const Points& between, Scan& scan)
{
  for (std::size_t i = 0; i < between.size(); ++i)
    if (!scan.isInHole(between.positions[i])) {
      scan.cloud.append(between, i);
      ++scan.outliers;
    }
}

void chooseHoles(const ScanOptions& options, Scan& scan)
{
  Random random(options.seed, cutting);
  const double smallest = scan.inCloudUnit(options.smallestHole), largest = scan.inCloudUnit(options.largestHole);
  for (const Vector3d& center : options.holeCenters)
    scan.holes.push_back({center, random.uniform(smallest, largest), 0});
  const std::vector<Vector3d>& places = scan.clean.positions;
  for (int i = 0; i < options.holes; ++i) {
    Hole hole{Vector3d::Zero(), random.uniform(smallest, largest), 0};
    const auto isApart = [&](const Hole& other) {
      return (other.center - hole.center).norm() >= other.radius + hole.radius;
    };
    int tries = 0;
    do {
      require(++tries <= 10000, "only " + std::to_string(i) + " of " + std::to_string(options.holes) +
                                    " holes find room on the object: ask for fewer or smaller ones");
      hole.center = places[random.index(places.size())];
    } while (!std::all_of(scan.holes.begin(), scan.holes.end(), isApart));
    scan.holes.push_back(hole);
  }
}

void cutHoles(const ScanOptions& options, Scan& scan)
{
  chooseHoles(options, scan);
  if (scan.holes.empty())
    return;
  Points kept;
  for (std::size_t i = 0; i < scan.clean.size(); ++i) {
    for (Hole& hole : scan.holes)
      hole.points += hole.holds(scan.clean.positions[i]) ? 1 : 0;
    (scan.isInHole(scan.clean.positions[i]) ? scan.heldOut : kept).append(scan.clean, i);
  }
  if (kept.positions.empty())
    throw InvalidInput("the holes leave no points: ask for smaller ones");
  scan.clean = std::move(kept);
}

void shuffle(std::uint64_t seed, Scan& scan)
{
  Random random(seed, shuffling);
  const std::size_t inliers = scan.clean.size();
  std::vector<std::size_t> order(scan.cloud.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  random.shuffle(order);
  Points cloud, clean;
  for (const std::size_t i : order) {
    cloud.append(scan.cloud, i);
    if (i < inliers)
      clean.append(scan.clean, i);
  }
  scan.cloud = std::move(cloud);
  scan.clean = std::move(clean);
}

} // namespace

void adopt(Device device, ScanOptions& options)
{
  options.device = device;
  if (device == Device::none)
    return;
  if (device == Device::photogrammetry) {
    options.noise = {1, Length::Unit::spacings};
    options.clusteredOutliers = 1;
    return;
  }
  options.sampling.pattern = device == Device::lidar ? Pattern::scanner : Pattern::camera;
  options.noise = {device == Device::depthCamera ? 0 : .2, Length::Unit::spacings};
}

double Scan::inCloudUnit(const Length& length) const
{
  if (length.unit == Length::Unit::diagonalPercent)
    return .01 * length.value * diagonal;
  return length.unit == Length::Unit::spacings ? length.value * spacing : length.value;
}

bool Scan::isInHole(const Vector3d& x) const
{
  return std::any_of(holes.begin(), holes.end(), [&](const Hole& hole) { return hole.holds(x); });
}

Scan simulateScan(const Surface& surface, const ScanOptions& options, Execution& execution)
{
  validate(options);
  const Vector3d center = rotate(options.rotation, surface.boundingBox().center());
  const Vector3d half = .5 * surface.boundingBox().sizes();
  const Box object(center - half, center + half);
  Scan scan;
  const Points between = sample(surface, object, options, execution, scan);
  cutHoles(options, scan);
  scan.cloud = scan.clean;
  addNoise(options, object, scan);
  addBetween(between, scan);
  misalign(options, center, scan);
  addOutliers(options, scan);
  if (options.areNormalsEstimated)
    estimateNormals(scan, execution);
  shuffle(options.seed, scan);
  return scan;
}

} // namespace pcl::mrf::scan

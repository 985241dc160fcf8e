// SPDX-License-Identifier: BSD-3-Clause
#include "random_scans.h"

#include "figure_support.h"
#include "scan/analytic_surface.h"
#include "scan/mesh_surface.h"
#include "scan/random.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace mrf_apps {

using figures::rounded;
using figures::text;
using pcl::mrf::scan::Length;
using pcl::mrf::scan::Pattern;
using pcl::mrf::scan::Random;

namespace {

/// A number with few digits, so that a command line repeats it exactly.
double few(Random& random, double lower, double upper)
{
  return rounded(random.uniform(lower, upper), 2);
}

struct Kind {
  const char* name;
  /// \param size of the object, cloud's unit
  std::string (*describe)(Random& random, double size);
};

std::string scaled(double size, double share)
{
  return text(size * share);
}

std::string describeBox(Random& random, double size, double rounding)
{
  const double y = few(random, .2, 1), z = few(random, .2, 1);
  return "box:x=" + scaled(size, 1) + ",y=" + scaled(size, y) + ",z=" + scaled(size, z) +
         ",rounding=" + scaled(size, rounding * std::min(y, z));
}

std::string describeTubes(Random& random, double size, bool isClosed)
{
  return "tubes:radius=" + scaled(size, few(random, .1, .4)) + ",length=" + scaled(size, few(random, .5, 1.5)) +
         ",gap=" + scaled(size, few(random, .1, .6)) + ",closed=" + (isClosed ? "1" : "0");
}

const std::vector<Kind>& kinds()
{
  static const std::vector<Kind> all = {
      {"bunny", [](Random&, double) { return std::string(figures::bunnyFile); }},
      {"sphere", [](Random&, double size) { return "sphere:radius=" + scaled(size, .5); }},
      {"torus",
       [](Random& random, double size) {
         return "torus:major=" + scaled(size, .5) + ",minor=" + scaled(size, few(random, .1, .48));
       }},
      {"sharp box", [](Random& random, double size) { return describeBox(random, size, 0); }},
      {"rounded box",
       [](Random& random, double size) {
         const double rounding = few(random, .05, .45);
         return describeBox(random, size, rounding);
       }},
      {"open tubes", [](Random& random, double size) { return describeTubes(random, size, false); }},
      {"closed tubes", [](Random& random, double size) { return describeTubes(random, size, true); }},
      {"primitives", [](Random&, double size) { return "primitives:size=" + scaled(size, .3); }},
      {"plate",
       [](Random& random, double size) {
         return "plate:width=" + scaled(size, 1) + ",height=" + scaled(size, few(random, .5, 1)) +
                ",thickness=" + scaled(size, few(random, .01, .15));
       }},
      {"cheese",
       [](Random& random, double size) {
         return "cheese:side=" + scaled(size, 1) + ",bubbles=" + std::to_string(random.index(30)) +
                ",radius=" + text(few(random, .08, .2));
       }},
      {"cut sphere",
       [](Random& random, double size) {
         return "cut-sphere:radius=" + scaled(size, .5) + ",angle=" + text(few(random, 20, 140));
       }},
      {"plane", [](Random& random, double size) {
         return "plane:width=" + scaled(size, 1) + ",height=" + scaled(size, few(random, .3, 1));
       }}};
  return all;
}

std::string textOf(const Length& length)
{
  const char* unit = length.unit == Length::Unit::spacings ? "s" : length.unit == Length::Unit::cloud ? "" : "%";
  return text(length.value) + unit;
}

} // namespace

RandomScan randomScan(std::uint64_t seed, int index)
{
  Random random(seed, static_cast<std::uint64_t>(index));
  const Kind& kind = kinds()[static_cast<std::size_t>(index) % kinds().size()];
  RandomScan result;
  result.kind = kind.name;
  result.object = kind.describe(random, rounded(std::pow(10, random.uniform(-2, 3)), 2));
  result.hasNormals = random.uniform() < .5;

  pcl::mrf::scan::ScanOptions& options = result.options;
  options.seed = 1 + random.index(1000000);
  options.sampling.points = 3000 + static_cast<std::int64_t>(random.index(2001));
  options.sampling.pattern = random.uniform() < .5 ? Pattern::even : Pattern::random;
  for (int axis = 0; axis < 3; ++axis)
    options.rotation[axis] = std::floor(random.uniform(0, 360));
  // One scan in four each is without noise, outliers and misalignment.
  const auto orNone = [&](double largest) { return random.uniform() < .25 ? 0 : few(random, 0, largest); };
  options.noise = {orNone(1), Length::Unit::spacings};
  options.uniformOutliers = orNone(3);
  options.misalignmentAngle = orNone(.5);
  options.misalignmentShift = {options.misalignmentAngle > 0 ? few(random, 0, .5) : 0, Length::Unit::spacings};
  options.holes = static_cast<int>(random.index(5));
  options.smallestHole = {4, Length::Unit::diagonalPercent};
  options.largestHole = {10, Length::Unit::diagonalPercent};
  return result;
}

std::unique_ptr<pcl::mrf::scan::Surface> RandomScan::load() const
{
  using namespace pcl::mrf::scan;
  if (isShape(object))
    return std::make_unique<AnalyticSurface>(makeShape(object));
  const auto mesh = figures::bunny();
  if (!mesh)
    throw pcl::mrf::InvalidInput(object + " is missing");
  return std::make_unique<MeshSurface>(mesh->vertices, mesh->triangles);
}

std::string RandomScan::commands() const
{
  std::string scan = "pcl_mrf_scan " + object + " scan.ply --seed " + std::to_string(options.seed) + " --points " +
                     std::to_string(options.sampling.points) + " --sampling " +
                     (options.sampling.pattern == Pattern::even ? "even" : "random") + " --rotate " +
                     text(options.rotation.x()) + "," + text(options.rotation.y()) + "," + text(options.rotation.z()) +
                     " --noise " + textOf(options.noise) + " --outliers " + text(options.uniformOutliers) +
                     " --misalign-angle " + text(options.misalignmentAngle) + " --misalign-shift " +
                     textOf(options.misalignmentShift) + " --holes " + std::to_string(options.holes) +
                     " --hole-radius " + textOf(options.smallestHole) + ":" + textOf(options.largestHole);
  std::string reconstruction = "pcl_mrf_reconstruction scan.ply mesh.ply";
  if (!hasNormals) {
    scan += " --normals none --write-views views.txt --write-sensors sensors.txt";
    reconstruction += " --views views.txt --sensors sensors.txt";
  }
  return scan + " && " + reconstruction;
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "scenes.h"

#include "random.h"
#include "solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

namespace pcl::mrf::scan {

using Eigen::Vector3d;

namespace {

/// How deep things stand in the ground, as a share of the scene: faces that only touch would both count as surface.
constexpr double sunk = 1e-3;

/// A sum of waves in the plane.
class Hills {
public:
  Hills(double side, double steepest, Random& random)
  {
    constexpr int count = 14;
    constexpr double longest = 1.2, shortest = .05;
    double slopes = 0;
    for (int i = 0; i < count; ++i) {
      // Evenly in the logarithm of the wavelength, by repeated multiplication; higher where longer.
      const double share = static_cast<double>(i) / (count - 1);
      const double wavelength = side * longest * shortest / (shortest + share * share * (longest - shortest));
      const SinCos around = sinCos(random.uniform());
      waves_.push_back({around.cosine / wavelength, around.sine / wavelength, random.uniform(),
                        wavelength * std::sqrt(wavelength / side)});
      slopes += 2 * pi * waves_.back().height / wavelength;
    }
    for (Wave& wave : waves_)
      wave.height *= steepest / slopes;
  }

  /// Height, and its slopes along x and y.
  double height(double x, double y, double& slopeX, double& slopeY) const
  {
    double result = 0;
    slopeX = slopeY = 0;
    for (const Wave& wave : waves_) {
      const SinCos value = sinCos(wave.x * x + wave.y * y + wave.phase);
      result += wave.height * value.sine;
      slopeX += 2 * pi * wave.height * wave.x * value.cosine;
      slopeY += 2 * pi * wave.height * wave.y * value.cosine;
    }
    return result;
  }

  double height(double x, double y) const
  {
    double slopeX, slopeY;
    return height(x, y, slopeX, slopeY);
  }

private:
  struct Wave {
    double x, y, phase; ///< turns per length, turns
    double height;
  };
  std::vector<Wave> waves_;
};

/// The ground over the square about the origin.
Patch groundPatch(const std::shared_ptr<const Hills>& hills, double side, double steepest)
{
  const double maxArea = std::sqrt(1 + steepest * steepest);
  const auto at = [=](const Draw& draw, SurfacePoint& point) {
    const double x = (draw.u - .5) * side, y = (draw.v - .5) * side;
    double slopeX, slopeY;
    const double z = hills->height(x, y, slopeX, slopeY);
    if (draw.accept * maxArea > std::sqrt(1 + slopeX * slopeX + slopeY * slopeY))
      return false;
    point.position = {x, y, z};
    point.normal = Vector3d(-slopeX, -slopeY, 1).normalized();
    return true;
  };
  return {side * side * maxArea, at};
}

Shape makeGround(const std::shared_ptr<const Hills>& hills, double side, double steepest)
{
  Shape ground;
  // The height above the ground is at most this much farther than the ground.
  const double factor = 1 / std::sqrt(1 + steepest * steepest);
  ground.distance = [=](const Vector3d& x) { return factor * (x.z() - hills->height(x.x(), x.y())); };
  ground.patches = {groundPatch(hills, side, steepest)};
  constexpr int cells = 100;
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (int i = 0; i <= cells; ++i)
    for (int j = 0; j <= cells; ++j) {
      const double z =
          hills->height((static_cast<double>(i) / cells - .5) * side, (static_cast<double>(j) / cells - .5) * side);
      lowest = std::min(lowest, z);
      highest = std::max(highest, z);
    }
  const double margin = steepest * side / cells;
  ground.box = {{-.5 * side, -.5 * side, lowest - margin}, {.5 * side, .5 * side, highest + margin}};
  return ground;
}

} // namespace

Shape makeTableScene(double size)
{
  const double s = size / 2.8;
  const auto at = [&](double x, double y, double z) { return Vector3d(s * x, s * y, s * z); };
  const double below = -sunk;
  return unite({
      makeBox(at(1.4, .9, .02), 0, at(0, .4, -.72)),                             // wall
      makeBox(at(.8, .02, .45), 0, at(0, -.02, 0)),                              // table
      makeBox(at(.09, .13, .05), 0, at(-.42, .13 + below, -.12)),                // carton
      makeBox(at(.11, .035, .07), .015 * s, at(-.2, .035 + below, .2)),          // soap dish
      makeCylinder(at(-.12, below, -.1), at(-.12, .16, -.1), .05 * s, true),     // can
      makeCylinder(at(.12, below, -.2), at(.12, .2, -.2), .04 * s, true),        // bottle
      makeCylinder(at(.12, .2 + below, -.2), at(.12, .28, -.2), .014 * s, true), // and its neck
      makeSphere(.08 * s, at(.22, .08 + below, .12)),                            // ball
      makeTorus(.08 * s, .025 * s, at(.48, .105 + below, -.05)),                 // ring
      makeBox(at(.1, .01, .14), 0, at(.5, .01 + below, .22)),                    // book
  });
}

Shape makeTerrain(const TerrainOptions& options)
{
  // Places belong to the shape, not to the scan's seed.
  Random random(1, 0);
  const double side = options.side;
  const auto hills = std::make_shared<const Hills>(side, options.steepest, random);
  std::vector<Shape> parts = {makeGround(hills, side, options.steepest)};
  const auto place = [&](double height) {
    const double x = random.uniform(-.45, .45) * side, y = random.uniform(-.45, .45) * side;
    return Vector3d(x, y, hills->height(x, y) + height);
  };
  for (int i = 0; i < options.houses; ++i) {
    Vector3d half;
    for (int axis = 0; axis < 3; ++axis)
      half[axis] = random.uniform(.02, .045) * side;
    parts.push_back(makeBox(half, 0, place(.4 * half.z())));
  }
  for (int i = 0; i < options.trees; ++i) {
    const double radius = random.uniform(.01, .025) * side;
    parts.push_back(makeSphere(radius, place(.8 * radius)));
  }
  return unite(parts);
}

Shape makeStreet(double length)
{
  Random random(1, 0);
  constexpr double halfWidth = 8, wall = 1, lot = 14, gap = 3;
  const double end = .5 * length;
  std::vector<Shape> parts = {makeBox({end, halfWidth, .1}, 0, {0, 0, -.1})};
  for (const double sign : {-1., 1.})
    for (int i = 0; i * lot - gap + lot <= length; ++i) {
      const double from = i * lot - end;
      const double height = random.uniform(5, 10), setback = random.uniform(0, 1);
      const double half = .5 * (lot - gap);
      parts.push_back(makeBox({half, wall, .5 * height}, 0,
                              {from + half, sign * (halfWidth - wall - sunk + setback), .5 * height - sunk}));
      // A balcony, partly in the wall.
      parts.push_back(
          makeBox({1.5, .6, .1}, 0, {from + half, sign * (halfWidth - 2 * wall + setback), random.uniform(2.5, 4)}));
    }
  constexpr double place = 9; // for a car
  for (int i = 0; (i + 1) * place <= length; ++i) {
    const double x = i * place - end + random.uniform(2.5, 4.5), y = random.uniform() < .5 ? -3.5 : 3.5;
    parts.push_back(makeBox({2.1, .85, .4}, .2, {x, y, .7}));
    parts.push_back(makeBox({1.1, .75, .35}, .15, {x - .2, y, 1.3}));
    parts.push_back(makeCylinder({x + 3.2, y, -sunk}, {x + 3.2, y, 5}, .1, true));
  }
  return unite(parts);
}

} // namespace pcl::mrf::scan

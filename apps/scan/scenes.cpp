// SPDX-License-Identifier: BSD-3-Clause
#include "analytic_surface.h"

#include "random.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace pcl::mrf::scan {

using Eigen::Vector3d;

namespace {

/// The depth of things in the ground, in the scene's unit: two faces that only touch would both count as surface.
constexpr double sunk = 1e-3;

/// A height field: a sum of waves in the plane.
class Hills {
public:
  Hills(double side, double steepest, Random& random)
  {
    constexpr int count = 14;
    constexpr double longest = 1.2, shortest = .05;
    double slopes = 0;
    for (int i = 0; i < count; ++i) {
      // From the longest wavelength to the shortest; longer waves are higher.
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
  // The height above the ground times this factor is a lower bound of the distance to it.
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
  ground.box = {Vector3d(-.5 * side, -.5 * side, lowest - margin), Vector3d(.5 * side, .5 * side, highest + margin)};
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

Shape makeRoom(double width)
{
  const double s = width / 5;
  const auto at = [&](double x, double y, double z) { return Vector3d(s * x, s * y, s * z); };
  const auto box = [&](const Vector3d& half, const Vector3d& center) { return makeBox(half, 0, center); };
  const auto rod = [&](const Vector3d& a, const Vector3d& b, double radius) {
    return makeCylinder(a, b, s * radius, true);
  };
  const Shape hollow = makeBox(at(2.5, 1.25, 2), 0, at(0, 1.25, 0));
  Shape walls{[inside = hollow.distance](const Vector3d& x) { return -inside(x); }, {}, hollow.box};
  for (const Patch& patch : hollow.patches)
    walls.patches.push_back(reversed(patch));
  std::vector<Shape> parts = {
      walls,
      box(at(.7, .02, .4), at(.3, .74, -.6)),                          // table
      box(at(.22, .02, .22), at(.3, .45, .2)),                         // chair
      box(at(.22, .25, .02), at(.3, .72, .41)),                        // and its back
      makeBox(at(.9, .22, .42), .08 * s, at(-1.2, .22 - sunk, -1.5)),  // sofa
      makeBox(at(.9, .42, .12), .06 * s, at(-1.2, .42 - sunk, -1.83)), // its back and arms
      makeBox(at(.1, .3, .42), .05 * s, at(-2.1, .3 - sunk, -1.5)),    //
      makeBox(at(.1, .3, .42), .05 * s, at(-.3, .3 - sunk, -1.5)),     //
      makeSphere(.14 * s, at(-.1, .9, -.55)),                          // bowl, bottle and carton on the table
      rod(at(.35, .75, -.75), at(.35, 1.02, -.75), .04),               //
      box(at(.1, .12, .07), at(.7, .875, -.5)),                        //
      rod(at(-2.2, -sunk, .6), at(-2.2, .03, .6), .15),                // lamp
      rod(at(-2.2, 0, .6), at(-2.2, 1.5, .6), .015),                   //
      makeSphere(.16 * s, at(-2.2, 1.6, .6)),                          //
      box(at(.03, 1, .2), at(1.05, 1 - sunk, -1.85)),                  // shelf
      box(at(.03, 1, .2), at(2.25, 1 - sunk, -1.85)),                  //
      box(at(.5, .35, .02), at(-1.2, 1.5, -2)),                        // picture on the wall
  };
  for (const double x : {-.35, .95})
    for (const double z : {-.95, -.25})
      parts.push_back(rod(at(x, -sunk, z), at(x, .74, z), .025));
  for (const double x : {.1, .5})
    for (const double z : {.02, .38})
      parts.push_back(rod(at(x, -sunk, z), at(x, .45, z), .02));
  Random random(1, 0);
  for (int board = 0; board < 5; ++board) {
    const double y = .1 + .4 * board;
    parts.push_back(box(at(.6, .015, .19), at(1.65, y, -1.85)));
    for (double x = 1.12; x < 2.05;) { // books
      const double half = random.uniform(.012, .03), high = random.uniform(.09, .15), deep = random.uniform(.07, .12);
      if (random.uniform() < .7)
        parts.push_back(box(at(half, high, deep), at(x + half, y + high, -1.9)));
      x += 2 * half + .003;
    }
  }
  Shape room = unite(parts);
  room.box = hollow.box;
  return room;
}

Shape makePerson(double height)
{
  const double s = height / 1.75;
  const auto at = [&](double x, double y, double z) { return Vector3d(s * x, s * y, s * z); };
  std::vector<Shape> parts = {
      makeSphere(.105 * s, at(0, 1.645, 0)),                      // head, chin, nose
      makeSphere(.075 * s, at(0, 1.58, .035)),                    //
      makeSphere(.02 * s, at(0, 1.63, .11)),                      //
      makeCylinder(at(0, 1.4, 0), at(0, 1.6, 0), .055 * s, true), // neck
      makeBox(at(.19, .17, .115), .1 * s, at(0, 1.28, 0)),        // chest
      makeBox(at(.15, .17, .1), .09 * s, at(0, 1.06, 0)),         // waist
      makeBox(at(.175, .12, .11), .1 * s, at(0, .92, 0)),         // hips
      makeBox(at(.13, .03, .02), .015 * s, at(0, 1.02, .095)),    // belt bag
  };
  const auto limb = [&](const Vector3d& a, const Vector3d& b, double radius) {
    parts.push_back(makeCylinder(a, b, s * radius, true));
    for (const Vector3d& end : {a, b})
      parts.push_back(makeSphere(1.001 * s * radius, end)); // so that no circle is surface of both
  };
  for (const double side : {-1., 1.}) {
    limb(at(.2 * side, 1.38, 0), at(.4 * side, 1.16, 0), .05);
    limb(at(.4 * side, 1.16, 0), at(.5 * side, .93, .1), .042);
    parts.push_back(makeSphere(.055 * s, at(.52 * side, .86, .12)));
    limb(at(.1 * side, .88, 0), at(.13 * side, .5, .02), .08);
    limb(at(.13 * side, .5, .02), at(.15 * side, .09, -.01), .058);
    parts.push_back(makeBox(at(.048, .045, .13), .04 * s, at(.15 * side, .045, .05)));
  }
  return unite(parts);
}

Shape makeFacade(double width)
{
  constexpr double axis = 2.5, floor = 3.2, depth = .25; // distances of windows and floors, depth of windows
  const int windows = std::max(1, static_cast<int>(width / axis));
  const double half = .5 * width, top = 3 * floor + .6;
  Shape wall = makeBox({half, .5 * top, .3}, 0, {0, .5 * top, -.3});
  std::vector<shapes::Sdf> cavities;
  std::vector<Shape> parts;
  for (int story = 0; story < 3; ++story) {
    const double y = story * floor;
    for (int i = 0; i < windows; ++i) {
      const double x = (i - .5 * (windows - 1)) * axis;
      const bool isDoor = story == 0 && i == windows / 2;
      const Vector3d opening(.55, isDoor ? 1.2 : .8, depth), center(x, y + (isDoor ? 1.2 - sunk : 1.8), 0);
      const Shape cavity = makeBox(opening, 0, center);
      cavities.push_back(cavity.distance);
      for (const Patch& patch : cavity.patches)
        wall.patches.push_back(reversed(patch));
      if (isDoor)
        continue;
      parts.push_back(makeBox({.7, .05, .12}, 0, {x, y + .96, 0}));     // sill
      parts.push_back(makeBox({.03, .85, .03}, 0, {x, y + 1.8, -.15})); // bars
      parts.push_back(makeBox({.6, .03, .03}, 0, {x, y + 1.9, -.15}));  //
      if (story == 1 && i == windows / 2) {                             // balcony
        parts.push_back(makeBox({1, .08, .6}, 0, {x, y + .5, .5}));
        parts.push_back(makeBox({1, .04, .04}, 0, {x, y + 1.5, 1.05}));
        for (int bar = -4; bar <= 4; ++bar)
          parts.push_back(makeCylinder({x + .24 * bar, y + .5, 1.05}, {x + .24 * bar, y + 1.5, 1.05}, .02, true));
      }
    }
    parts.push_back(makeBox({half + .05, .1, .15}, 0, {0, y + floor - .05, 0})); // cornice
  }
  wall.distance = shapes::subtract(wall.distance, std::move(cavities));
  parts.push_back(wall);
  for (const double side : {-1., 1.}) {
    parts.push_back(makeCylinder({side * .8, -sunk, .35}, {side * .8, 2.7, .35}, .12, true));
    parts.push_back(makeCylinder({side * (half - .15), 0, .06}, {side * (half - .15), top, .06}, .05, true)); // pipe
  }
  parts.push_back(makeBox({1, .1, .35}, 0, {0, 2.75, .3}));
  parts.push_back(makeBox({half, .1, 1.55}, 0, {0, sunk - .1, 1.25})); // pavement
  return unite(parts);
}

Shape makeTerrain(double side, double steepest, int trees, int houses)
{
  // Places belong to the shape, not to the scan's seed.
  Random random(1, 0);
  const auto hills = std::make_shared<const Hills>(side, steepest, random);
  std::vector<Shape> parts = {makeGround(hills, side, steepest)};
  const auto place = [&](double height) {
    const double x = random.uniform(-.45, .45) * side, y = random.uniform(-.45, .45) * side;
    return Vector3d(x, y, hills->height(x, y) + height);
  };
  for (int i = 0; i < houses; ++i) {
    Vector3d half;
    for (int axis = 0; axis < 3; ++axis)
      half[axis] = random.uniform(.02, .045) * side;
    parts.push_back(makeBox(half, 0, place(.4 * half.z())));
  }
  for (int i = 0; i < trees; ++i) {
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

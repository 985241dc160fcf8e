// SPDX-License-Identifier: BSD-3-Clause
#include "analytic_surface.h"
#include "random.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <sstream>
#include <string_view>

namespace pcl::mrf::scan {

using Eigen::Vector3d;
using shapes::Sdf;

namespace {

std::string text(double value)
{
  std::array<char, 32> digits;
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

struct Parameter {
  const char* name;
  double usual; ///< default
  double lower = 1e-30, upper = 1e30;
  const char* range = "positive"; ///< for messages; the value must be whole if this begins with "a whole"
};

/// The values of the parameters of one shape.
class Values {
public:
  Values(const std::string& description, const std::vector<Parameter>& known)
      : shape_(description.substr(0, description.find(':')))
  {
    for (const Parameter& parameter : known)
      values_[parameter.name] = parameter.usual;
    std::istringstream rest(description.substr(std::min(shape_.size() + 1, description.size())));
    for (std::string item; std::getline(rest, item, ',');)
      set(item);
    for (const auto& [name, usual, lower, upper, range] : known) {
      const double value = values_.at(name);
      const bool isWhole = std::string_view(range).substr(0, 7) == "a whole";
      require(name, value >= lower && value <= upper && (!isWhole || value == std::floor(value)), range);
    }
  }

  double operator[](const char* name) const { return values_.at(name); }

  void require(const char* name, bool holds, const std::string& range) const
  {
    if (!holds)
      fail(std::string(name) + " is " + text(values_.at(name)) + ", it must be " + range);
  }

private:
  [[noreturn]] void fail(const std::string& cause) const { throw InvalidOption("shape " + shape_ + ": " + cause); }

  void set(const std::string& item)
  {
    const std::size_t equals = std::min(item.find('='), item.size());
    const std::string name = item.substr(0, equals);
    const auto found = values_.find(name);
    if (found == values_.end()) {
      std::string names;
      for (const auto& value : values_)
        names += (names.empty() ? "" : ", ") + value.first;
      fail("unknown parameter '" + name + "', it has " + names);
    }
    const char *begin = item.data() + std::min(equals + 1, item.size()), *end = item.data() + item.size();
    const auto result = std::from_chars(begin, end, found->second);
    if (result.ec != std::errc() || result.ptr != end || !std::isfinite(found->second))
      fail("'" + item + "' is not of the form " + name + "=NUMBER");
  }

  std::string shape_;
  std::map<std::string, double> values_;
};

Shape makeCutSphere(const Values& v)
{
  const double radius = v["radius"], turns = v["angle"] / 360;
  const SinCos edge = sinCos(turns);
  const double widest = turns < .25 ? radius * edge.sine : radius;
  const Box box(Vector3d(-widest, -widest, radius * edge.cosine), Vector3d(widest, widest, radius));
  return {shapes::sphere(radius), {spherePatch(radius, Vector3d::Zero(), edge.cosine)}, box};
}

Shape makePlane(const Values& v)
{
  const Vector3d half(.5 * v["width"], .5 * v["height"], 0);
  const Patch patch = rectanglePatch(-half, {2 * half.x(), 0, 0}, {0, 2 * half.y(), 0});
  return {shapes::plane({0, 0, 1}), {patch}, boxOf(half)};
}

Shape makeTubes(const Values& v)
{
  const double radius = v["radius"];
  const bool areEndsClosed = v["closed"] != 0;
  const Vector3d near(.5 * v["gap"], 0, 0), far(.5 * v["gap"] + v["length"], 0, 0);
  Shape shape =
      unite({makeCylinder(-far, -near, radius, areEndsClosed), makeCylinder(near, far, radius, areEndsClosed)});
  if (!areEndsClosed)
    shape.isOpen = [=](const Vector3d& x) { return std::sqrt(x.y() * x.y() + x.z() * x.z()) < radius * (1 - 1e-9); };
  return shape;
}

Shape makePrimitives(const Values& v)
{
  const double s = v["size"];
  // Two rows side by side, nearest ones .3 apart; the z axis is the scanner's usual front.
  return unite({makeSphere(.5 * s, {-1.35 * s, .7 * s, 0}), makeSphere(.2 * s, {1.75 * s, .7 * s, 0}),
                makeTorus(.42 * s, .15 * s, {0, .7 * s, 0}), makeSphere(.3 * s, {1.05 * s, .7 * s, 0}),
                makeBox({.4 * s, .4 * s, .4 * s}, 0, {-1.35 * s, -.7 * s, 0}),
                makeBox({.35 * s, .45 * s, .25 * s}, .12 * s, {-.2 * s, -.7 * s, 0}),
                makeCylinder({.8 * s, -1.2 * s, 0}, {.8 * s, -.2 * s, 0}, .25 * s, true),
                makeBox({.1 * s, .5 * s, .3 * s}, 0, {1.65 * s, -.7 * s, 0})});
}

Shape makeCheese(const Values& v)
{
  const double side = v["side"], radius = side * v["radius"];
  const Vector3d half = Vector3d::Constant(.5 * side);
  Shape shape = makeBox(half, 0);
  std::vector<Sdf> cavities;

  // A tunnel along each axis, apart from each other; they end outside so that no end wall is left.
  const double tunnel = .06 * side;
  for (int axis = 0; axis < 3; ++axis) {
    Vector3d middle = Vector3d::Zero();
    middle[(axis + 1) % 3] = .2 * side;
    const Vector3d reach = .6 * side * Vector3d::Unit(axis);
    cavities.push_back(shapes::cylinder(middle - reach, middle + reach, tunnel));
    shape.patches.push_back(reversed(cylinderPatch(middle - reach, middle + reach, tunnel)));
  }
  // Bubbles are centered on the faces, so that each is open. Their places do not depend on the scan's seed.
  Random random(1, 0);
  for (int i = 0; i < v["bubbles"]; ++i) {
    Vector3d center;
    for (int axis = 0; axis < 3; ++axis)
      center[axis] = random.uniform(-.4, .4) * side;
    center[i % 3] = (i / 3 % 2 ? .5 : -.5) * side;
    const double bubble = radius * random.uniform(.5, 1);
    cavities.push_back(shapes::sphere(bubble, center));
    shape.patches.push_back(reversed(spherePatch(bubble, center)));
  }
  shape.distance = shapes::subtract(shape.distance, std::move(cavities));
  return shape;
}

Shape makeRoundedBox(const Values& v)
{
  const Vector3d half(.5 * v["x"], .5 * v["y"], .5 * v["z"]);
  v.require("rounding", v["rounding"] <= half.minCoeff(), "from 0 to half of the shortest side");
  return makeBox(half, v["rounding"]);
}

Shape makeDoughnut(const Values& v)
{
  v.require("minor", v["minor"] <= v["major"], "positive and at most the major radius");
  return makeTorus(v["major"], v["minor"]);
}

struct Entry {
  const char* name;
  std::vector<Parameter> parameters;
  const char* meaning;
  Shape (*make)(const Values&);
};

const std::vector<Entry>& catalog()
{
  static const std::vector<Entry> entries = {
      {"sphere", {{"radius", 1}}, "about the origin", [](const Values& v) { return makeSphere(v["radius"]); }},
      {"cut-sphere",
       {{"radius", 40}, {"angle", 37, 1e-3, 180, "degrees, above 0 and at most 180"}},
       "cap of a sphere about the origin around +z, open; angle: from the pole, in degrees",
       makeCutSphere},
      {"torus", {{"major", 1}, {"minor", .4}}, "around the z axis", makeDoughnut},
      {"box",
       {{"x", 2}, {"y", 1.5}, {"z", 1}, {"rounding", 0, 0, 1e30, "not negative"}},
       "whole sides; sharp edges with rounding=0",
       makeRoundedBox},
      {"plane", {{"width", 2}, {"height", 2}}, "patch of z = 0, facing +z", makePlane},
      {"tubes",
       {{"radius", .25}, {"length", 1}, {"gap", .5}, {"closed", 0, 0, 1, "0 or 1"}},
       "two tubes along the x axis, separated by a gap; closed=1 with end walls",
       makeTubes},
      {"primitives", {{"size", 1}}, "spheres, boxes, torus, cylinder, plate side by side", makePrimitives},
      {"cheese",
       {{"side", 2},
        {"bubbles", 14, 0, 200, "a whole number, 0 to 200"},
        {"radius", .16, .01, .3, "a share of the side, .01 to .3"}},
       "cube with open bubbles and three tunnels; radius: of the largest bubble, as a share of the side",
       makeCheese},
      {"table",
       {{"size", 2.8}},
       "objects on a table before a wall, y up, to be seen from +z; size: width of the wall",
       [](const Values& v) { return makeTableScene(v["size"]); }},
      {"room",
       {{"width", 5}},
       "with furniture, y up, to be seen from inside, e.g. --sampling camera --sensor 0.6,1.5,1.9 --front -.1,-.25,-1",
       [](const Values& v) { return makeRoom(v["width"]); }},
      {"person",
       {{"height", 1.75}},
       "standing, y up, facing +z",
       [](const Values& v) { return makePerson(v["height"]); }},
      {"facade",
       {{"width", 13, 3, 1000, "from 3 to 1000"}},
       "of a house of three floors, y up, to be seen from +z",
       [](const Values& v) { return makeFacade(v["width"]); }},
      {"terrain",
       {{"side", 100},
        {"steepest", 1, 0, 10, "from 0 to 10"},
        {"trees", 60, 0, 1000, "a whole number, 0 to 1000"},
        {"houses", 12, 0, 1000, "a whole number, 0 to 1000"}},
       "hills with trees and houses, z up, to be seen from above (+z), open; steepest: bound of the slope",
       [](const Values& v) { return makeTerrain(v["side"], v["steepest"], int(v["trees"]), int(v["houses"])); }},
      {"street",
       {{"length", 60, 14, 1000, "from 14 to 1000"}},
       "between houses, with cars and posts, z up, 16 wide; for a lidar: --sampling scanner --axis 0,0,1 "
       "--sensor 0,0,1.8 --aspect 8 --elevations -30:30",
       [](const Values& v) { return makeStreet(v["length"]); }},
  };
  return entries;
}

const Entry* find(const std::string& description)
{
  const std::string name = description.substr(0, description.find(':'));
  for (const Entry& entry : catalog())
    if (name == entry.name)
      return &entry;
  return nullptr;
}

} // namespace

bool isShape(const std::string& description)
{
  return find(description) != nullptr;
}

Shape makeShape(const std::string& description)
{
  const Entry* entry = find(description);
  if (!entry) {
    std::string names;
    for (const Entry& known : catalog())
      names += (names.empty() ? "" : ", ") + std::string(known.name);
    throw InvalidOption("unknown shape '" + description + "', there are " + names);
  }
  return entry->make(Values(description, entry->parameters));
}

std::string describeShapes()
{
  std::string lines;
  for (const Entry& entry : catalog()) {
    std::string line = std::string("  ") + entry.name;
    char separator = ':';
    for (const Parameter& parameter : entry.parameters) {
      line += separator + std::string(parameter.name) + "=" + text(parameter.usual);
      separator = ',';
    }
    lines += line + "\n      " + entry.meaning + "\n";
  }
  return lines;
}

} // namespace pcl::mrf::scan

#include "analytic_surface.h"
#include "random.h"

#include <pcl/surface/mrf/exceptions.h>
#include <shapes/portable_math.h>

#include <charconv>
#include <cmath>
#include <sstream>

namespace pcl {
namespace mrf {
namespace scan {

using Eigen::Vector3d;
using shapes::Sdf;

namespace {

std::string text(double value)
{
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << value;
  return stream.str();
}

struct Parameter {
  const char* name;
  double value; ///< default
};

/// The parameters of one shape, with the values of its description.
class Parameters {
public:
  Parameters(const std::string& description, const std::vector<Parameter>& known)
      : shape_(description.substr(0, description.find(':'))), values_(known)
  {
    if (shape_.size() == description.size())
      return;
    std::istringstream rest(description.substr(shape_.size() + 1));
    for (std::string item; std::getline(rest, item, ',');)
      set(item);
  }

  double any(const char* name) const
  {
    for (const Parameter& parameter : values_)
      if (std::string(parameter.name) == name)
        return parameter.value;
    throw std::logic_error(std::string("no parameter ") + name);
  }

  double inRange(const char* name, double lower, double upper, const char* range) const
  {
    const double value = any(name);
    if (!(value >= lower && value <= upper))
      throw InvalidOption("shape " + shape_ + ": " + name + " is " + text(value) + ", it must be " + range);
    return value;
  }

  double positive(const char* name) const { return inRange(name, 1e-30, 1e30, "positive"); }

  int count(const char* name, int most) const
  {
    const double value = inRange(name, 0, most, ("a whole number, 0 to " + std::to_string(most)).c_str());
    if (value != std::floor(value))
      throw InvalidOption("shape " + shape_ + ": " + name + " is " + text(value) + ", it must be a whole number");
    return static_cast<int>(value);
  }

private:
  void set(const std::string& item)
  {
    const std::size_t equals = std::min(item.find('='), item.size());
    const std::string name = item.substr(0, equals);
    for (Parameter& parameter : values_) {
      if (name != parameter.name)
        continue;
      const char *begin = item.data() + std::min(equals + 1, item.size()), *end = item.data() + item.size();
      const auto result = std::from_chars(begin, end, parameter.value);
      if (result.ec != std::errc() || result.ptr != end || !std::isfinite(parameter.value))
        throw InvalidOption("shape " + shape_ + ": '" + item + "' is not of the form " + name + "=NUMBER");
      return;
    }
    std::string names;
    for (const Parameter& parameter : values_)
      names += (names.empty() ? "" : ", ") + std::string(parameter.name);
    throw InvalidOption("shape " + shape_ + ": unknown parameter '" + name + "', it has " + names);
  }

  std::string shape_;
  std::vector<Parameter> values_;
};

Box boxOf(const Vector3d& half, const Vector3d& centre = Vector3d::Zero())
{
  return {centre - half, centre + half};
}

/// The six faces of a box, shorter by `margin` at each end.
void addFaces(std::vector<Patch>& patches, const Vector3d& half, const Vector3d& centre, double margin)
{
  for (int axis = 0; axis < 3; ++axis) {
    const int second = (axis + 1) % 3, third = (axis + 2) % 3;
    if (!(half[second] > margin && half[third] > margin))
      continue;
    const Vector3d out = half[axis] * Vector3d::Unit(axis);
    const Vector3d u = (half[second] - margin) * Vector3d::Unit(second),
                   v = (half[third] - margin) * Vector3d::Unit(third);
    patches.push_back(rectanglePatch(centre + out - u - v, 2 * u, 2 * v));
    patches.push_back(rectanglePatch(centre - out - u - v, 2 * v, 2 * u));
  }
}

Shape makeBox(const Vector3d& half, double rounding, const Vector3d& centre = Vector3d::Zero())
{
  Shape shape;
  shape.distance = shapes::translate(shapes::box(half, rounding), centre);
  shape.box = boxOf(half, centre);
  addFaces(shape.patches, half, centre, rounding);
  if (rounding == 0)
    return shape;
  // Whole cylinders and spheres: what lies inside of the box is rejected.
  const Vector3d inner = half - Vector3d::Constant(rounding);
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    const Vector3d at = centre + inner.cwiseProduct(sign);
    shape.patches.push_back(spherePatch(rounding, at));
    for (int axis = 0; axis < 3; ++axis)
      if (sign[axis] < 0 && inner[axis] > 0)
        shape.patches.push_back(cylinderPatch(at, at + 2 * inner[axis] * Vector3d::Unit(axis), rounding));
  }
  return shape;
}

Shape makeSphere(double radius, const Vector3d& centre = Vector3d::Zero())
{
  return {shapes::sphere(radius, centre), {spherePatch(radius, centre)}, boxOf(Vector3d::Constant(radius), centre)};
}

Shape makeTorus(double majorRadius, double minorRadius, const Vector3d& centre = Vector3d::Zero())
{
  const double side = majorRadius + minorRadius;
  return {shapes::translate(shapes::torus(majorRadius, minorRadius), centre),
          {torusPatch(majorRadius, minorRadius, centre)},
          boxOf({side, side, minorRadius}, centre)};
}

/// Along the x axis or the z axis.
Shape makeCylinder(const Vector3d& a, const Vector3d& b, double radius, bool areEndsClosed)
{
  Shape shape;
  shape.distance = shapes::cylinder(a, b, radius);
  shape.patches.push_back(cylinderPatch(a, b, radius));
  if (areEndsClosed) {
    shape.patches.push_back(discPatch(a, a - b, radius));
    shape.patches.push_back(discPatch(b, b - a, radius));
  }
  const Vector3d axis = portable::unit(b - a);
  const Vector3d across = radius * (Vector3d::Ones() - axis.cwiseProduct(axis)).cwiseMax(0).cwiseSqrt();
  shape.box = {a.cwiseMin(b) - across, a.cwiseMax(b) + across};
  return shape;
}

Shape unite(const std::vector<Shape>& parts)
{
  Shape all;
  std::vector<Sdf> distances;
  all.box = parts.front().box;
  for (const Shape& part : parts) {
    distances.push_back(part.distance);
    all.patches.insert(all.patches.end(), part.patches.begin(), part.patches.end());
    all.box.lower = all.box.lower.cwiseMin(part.box.lower);
    all.box.upper = all.box.upper.cwiseMax(part.box.upper);
  }
  all.distance = shapes::unite(std::move(distances));
  return all;
}

Shape makeCutSphere(const Parameters& parameters)
{
  const double radius = parameters.positive("radius");
  const double turns = parameters.inRange("angle", 1e-3, 180, "degrees, above 0 and at most 180") / 360;
  const portable::SinCos edge = portable::sinCos(turns);
  const double widest = turns < .25 ? radius * edge.sine : radius;
  Box box{{-widest, -widest, radius * edge.cosine}, {widest, widest, radius}};
  return {shapes::sphere(radius), {capPatch(radius, turns)}, box};
}

Shape makePlane(const Parameters& parameters)
{
  const Vector3d half(.5 * parameters.positive("width"), .5 * parameters.positive("height"), 0);
  const Patch patch = rectanglePatch(-half, {2 * half.x(), 0, 0}, {0, 2 * half.y(), 0});
  return {shapes::plane({0, 0, 1}), {patch}, boxOf(half)};
}

Shape makeTubes(const Parameters& parameters)
{
  const double radius = parameters.positive("radius"), length = parameters.positive("length");
  const double gap = parameters.positive("gap");
  const bool areEndsClosed = parameters.inRange("closed", 0, 1, "0 or 1") != 0;
  const Vector3d near(.5 * gap, 0, 0), far(.5 * gap + length, 0, 0);
  return unite({makeCylinder(-far, -near, radius, areEndsClosed), makeCylinder(near, far, radius, areEndsClosed)});
}

Shape makePrimitives(const Parameters& parameters)
{
  const double s = parameters.positive("size");
  // Two rows side by side, nearest ones .3 apart; the z axis is the scanner's usual front.
  return unite({makeSphere(.5 * s, {-1.35 * s, .7 * s, 0}), makeSphere(.2 * s, {1.75 * s, .7 * s, 0}),
                makeTorus(.42 * s, .15 * s, {0, .7 * s, 0}), makeSphere(.3 * s, {1.05 * s, .7 * s, 0}),
                makeBox({.4 * s, .4 * s, .4 * s}, 0, {-1.35 * s, -.7 * s, 0}),
                makeBox({.35 * s, .45 * s, .25 * s}, .12 * s, {-.2 * s, -.7 * s, 0}),
                makeCylinder({.8 * s, -1.2 * s, 0}, {.8 * s, -.2 * s, 0}, .25 * s, true),
                makeBox({.1 * s, .5 * s, .3 * s}, 0, {1.65 * s, -.7 * s, 0})});
}

Shape makeCheese(const Parameters& parameters)
{
  const double side = parameters.positive("side");
  const double radius = side * parameters.inRange("radius", .01, .3, "a share of the side, .01 to .3");
  const int bubbles = parameters.count("bubbles", 200);
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
  // Bubbles are centred on the faces, so that each is open; their places belong to the shape, not to the scan's seed.
  Random random(1, 0);
  for (int i = 0; i < bubbles; ++i) {
    Vector3d centre;
    for (int axis = 0; axis < 3; ++axis)
      centre[axis] = random.uniform(-.4, .4) * side;
    centre[i % 3] = (i / 3 % 2 ? .5 : -.5) * side;
    const double bubble = radius * random.uniform(.5, 1);
    cavities.push_back(shapes::sphere(bubble, centre));
    shape.patches.push_back(reversed(spherePatch(bubble, centre)));
  }
  shape.distance = shapes::subtract(shape.distance, std::move(cavities));
  return shape;
}

Shape makeRoundedBox(const Parameters& parameters)
{
  const Vector3d half(.5 * parameters.positive("x"), .5 * parameters.positive("y"), .5 * parameters.positive("z"));
  return makeBox(half, parameters.inRange("rounding", 0, half.minCoeff(), "from 0 to half of the shortest side"));
}

Shape makePlate(const Parameters& parameters)
{
  const Vector3d half(.5 * parameters.positive("width"), .5 * parameters.positive("height"),
                      .5 * parameters.positive("thickness"));
  return makeBox(half, 0);
}

struct Entry {
  const char* name;
  std::vector<Parameter> parameters;
  const char* meaning;
  Shape (*make)(const Parameters&);
};

const std::vector<Entry>& catalogue()
{
  static const std::vector<Entry> entries = {
      {"sphere",
       {{"radius", 1}},
       "about the origin",
       [](const Parameters& p) { return makeSphere(p.positive("radius")); }},
      {"cut-sphere",
       {{"radius", 40}, {"angle", 37}},
       "cap of a sphere about the origin around +z, open; angle: from the pole, in degrees",
       makeCutSphere},
      {"torus",
       {{"major", 1}, {"minor", .4}},
       "around the z axis",
       [](const Parameters& p) {
         const double major = p.positive("major");
         return makeTorus(major, p.inRange("minor", 1e-30, major, "positive and at most the major radius"));
       }},
      {"box",
       {{"x", 2}, {"y", 1.5}, {"z", 1}, {"rounding", 0}},
       "whole sides; sharp edges with rounding=0",
       makeRoundedBox},
      {"plane", {{"width", 2}, {"height", 2}}, "patch of z = 0, facing +z", makePlane},
      {"tubes",
       {{"radius", .25}, {"length", 1}, {"gap", .5}, {"closed", 0}},
       "two tubes along the x axis, separated by a gap; closed=1 with end walls",
       makeTubes},
      {"primitives", {{"size", 1}}, "spheres, boxes, torus, cylinder, plate side by side", makePrimitives},
      {"plate", {{"width", 2}, {"height", 2}, {"thickness", .04}}, "thin plate", makePlate},
      {"cheese",
       {{"side", 2}, {"bubbles", 14}, {"radius", .16}},
       "cube with open bubbles and three tunnels; radius: of the largest bubble, as a share of the side",
       makeCheese},
  };
  return entries;
}

const Entry* find(const std::string& description)
{
  const std::string name = description.substr(0, description.find(':'));
  for (const Entry& entry : catalogue())
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
    for (const Entry& known : catalogue())
      names += (names.empty() ? "" : ", ") + std::string(known.name);
    throw InvalidOption("unknown shape '" + description + "', there are " + names);
  }
  return entry->make(Parameters(description, entry->parameters));
}

std::string describeShapes()
{
  std::string lines;
  for (const Entry& entry : catalogue()) {
    std::string line = std::string("  ") + entry.name;
    char separator = ':';
    for (const Parameter& parameter : entry.parameters) {
      line += separator + std::string(parameter.name) + "=" + text(parameter.value);
      separator = ',';
    }
    lines += line + "\n      " + entry.meaning + "\n";
  }
  return lines;
}

} // namespace scan
} // namespace mrf
} // namespace pcl

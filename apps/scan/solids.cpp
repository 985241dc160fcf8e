// SPDX-License-Identifier: BSD-3-Clause
#include "analytic_surface.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace pcl::mrf::scan {

using Eigen::Vector3d;
using shapes::Sdf;

namespace {

/// Adds the six faces of a box, shorter by `margin` at each end.
void addFaces(std::vector<Patch>& patches, const Vector3d& half, const Vector3d& center, double margin)
{
  for (int axis = 0; axis < 3; ++axis) {
    const int second = (axis + 1) % 3, third = (axis + 2) % 3;
    if (!(half[second] > margin && half[third] > margin))
      continue;
    const Vector3d out = half[axis] * Vector3d::Unit(axis);
    const Vector3d u = (half[second] - margin) * Vector3d::Unit(second),
                   v = (half[third] - margin) * Vector3d::Unit(third);
    patches.push_back(rectanglePatch(center + out - u - v, 2 * u, 2 * v));
    patches.push_back(rectanglePatch(center - out - u - v, 2 * v, 2 * u));
  }
}

} // namespace

Box boxOf(const Vector3d& half, const Vector3d& center)
{
  return {center - half, center + half};
}

Shape makeBox(const Vector3d& half, double rounding, const Vector3d& center)
{
  Shape shape;
  shape.distance = shapes::translate(shapes::box(half, rounding), center);
  shape.box = boxOf(half, center);
  addFaces(shape.patches, half, center, rounding);
  if (rounding == 0)
    return shape;
  // Whole cylinders and spheres: their parts inside the box are rejected.
  const Vector3d inner = half - Vector3d::Constant(rounding);
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    const Vector3d at = center + inner.cwiseProduct(sign);
    shape.patches.push_back(spherePatch(rounding, at));
    for (int axis = 0; axis < 3; ++axis)
      if (sign[axis] < 0 && inner[axis] > 0)
        shape.patches.push_back(cylinderPatch(at, at + 2 * inner[axis] * Vector3d::Unit(axis), rounding));
  }
  return shape;
}

Shape makeSphere(double radius, const Vector3d& center)
{
  return {shapes::sphere(radius, center), {spherePatch(radius, center)}, boxOf(Vector3d::Constant(radius), center)};
}

Shape makeTorus(double majorRadius, double minorRadius, const Vector3d& center)
{
  const double side = majorRadius + minorRadius;
  return {shapes::translate(shapes::torus(majorRadius, minorRadius), center),
          {torusPatch(majorRadius, minorRadius, center)},
          boxOf({side, side, minorRadius}, center)};
}

Shape makeCylinder(const Vector3d& a, const Vector3d& b, double radius, bool areEndsClosed)
{
  Shape shape;
  shape.distance = shapes::cylinder(a, b, radius);
  shape.patches.push_back(cylinderPatch(a, b, radius));
  if (areEndsClosed) {
    shape.patches.push_back(discPatch(a, a - b, radius));
    shape.patches.push_back(discPatch(b, b - a, radius));
  }
  const Vector3d axis = (b - a).normalized();
  const Vector3d across = radius * (Vector3d::Ones() - axis.cwiseProduct(axis)).cwiseMax(0).cwiseSqrt();
  shape.box = {a.cwiseMin(b) - across, a.cwiseMax(b) + across};
  return shape;
}

Shape unite(const std::vector<Shape>& parts)
{
  Shape all;
  std::vector<std::pair<Sdf, Box>> solids;
  for (const Shape& part : parts) {
    solids.emplace_back(part.distance, part.box);
    all.patches.insert(all.patches.end(), part.patches.begin(), part.patches.end());
    all.box.extend(part.box);
  }
  all.distance = [solids = std::move(solids)](const Vector3d& x) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [distance, box] : solids) {
      // Parts whose boxes are farther away are skipped.
      const double square = (box.min() - x).cwiseMax(x - box.max()).cwiseMax(0).squaredNorm();
      if (square == 0 || (nearest > 0 && square < nearest * nearest))
        nearest = std::min(nearest, distance(x));
    }
    return nearest;
  };
  return all;
}

} // namespace pcl::mrf::scan

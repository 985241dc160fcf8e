// SPDX-License-Identifier: BSD-3-Clause
#include "signed_distance.h"

#include <algorithm>
#include <limits>

namespace shapes {

using Eigen::Vector3d;

namespace {

double hypotenuse(double a, double b)
{
  return std::sqrt(a * a + b * b);
}

} // namespace

Sdf sphere(double radius, const Vector3d& center)
{
  return [=](const Vector3d& x) { return (x - center).norm() - radius; };
}

Sdf torus(double majorRadius, double minorRadius)
{
  return [=](const Vector3d& x) { return hypotenuse(hypotenuse(x.x(), x.y()) - majorRadius, x.z()) - minorRadius; };
}

Sdf box(const Vector3d& half, double rounding)
{
  return [=](const Vector3d& x) {
    const Vector3d q = x.cwiseAbs() - (half - Vector3d::Constant(rounding));
    return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0) - rounding;
  };
}

Sdf tube(const Vector3d& a, const Vector3d& b, double radius)
{
  return [=](const Vector3d& x) {
    const double t = std::clamp((x - a).dot(b - a) / (b - a).dot(b - a), 0.0, 1.0);
    return (x - a - t * (b - a)).norm() - radius;
  };
}

Sdf cylinder(const Vector3d& a, const Vector3d& b, double radius)
{
  const Vector3d center = .5 * (a + b), axis = (b - a).normalized();
  const double halfLength = .5 * (b - a).norm();
  return [=](const Vector3d& x) {
    const double height = (x - center).dot(axis);
    const double across = (x - center - height * axis).norm() - radius;
    const double along = std::abs(height) - halfLength;
    return hypotenuse(std::max(across, 0.0), std::max(along, 0.0)) + std::min(std::max(across, along), 0.0);
  };
}

Sdf plane(const Vector3d& normal)
{
  const Vector3d unit = normal.normalized();
  return [=](const Vector3d& x) { return unit.dot(x); };
}

Sdf translate(const Sdf& shape, const Vector3d& offset)
{
  return [=](const Vector3d& x) { return shape(x - offset); };
}

Sdf unite(const Sdf& a, const Sdf& b)
{
  return [=](const Vector3d& x) { return std::min(a(x), b(x)); };
}

Sdf unite(std::vector<Sdf> shapes)
{
  return [shapes = std::move(shapes)](const Vector3d& x) {
    double distance = std::numeric_limits<double>::infinity();
    for (const Sdf& shape : shapes)
      distance = std::min(distance, shape(x));
    return distance;
  };
}

Sdf subtract(const Sdf& a, std::vector<Sdf> b)
{
  return [a, b = std::move(b)](const Vector3d& x) {
    double distance = a(x);
    for (const Sdf& shape : b)
      distance = std::max(distance, -shape(x));
    return distance;
  };
}

Vector3d normalOf(const Sdf& sdf, const Vector3d& position, double step)
{
  Vector3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d offset = step * Vector3d::Unit(axis);
    gradient[axis] = sdf(position + offset) - sdf(position - offset);
  }
  return gradient.normalized();
}

} // namespace shapes

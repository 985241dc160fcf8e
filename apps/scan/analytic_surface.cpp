// SPDX-License-Identifier: BSD-3-Clause
#include "analytic_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pcl::mrf::scan {

using Eigen::Vector3d;

namespace {

/// Halves the parameter cells of a patch until each is flat, and either on the surface or off it.
struct Tessellation {
  const Shape& shape;
  const Patch& patch;
  Triangles& result;
  double diagonal = shape.box.diagonal().norm();

  void cut(const Eigen::Array2d& lower, const Eigen::Array2d& side)
  {
    std::array<SurfacePoint, 9> points;
    int found = 0;
    for (int i = 0; i < 9; ++i)
      found += at(lower + .5 * side * Eigen::Array2d(i % 3, i / 3), points[i]) ? 1 : 0;
    // Along u and along v, through the middle, because the ends of a closed line are at the same place.
    Eigen::Array2d length, sag;
    for (int axis = 0; axis < 2; ++axis) {
      const Vector3d &a = points[axis == 0 ? 3 : 1].position, &b = points[axis == 0 ? 5 : 7].position;
      length[axis] = (points[4].position - a).norm() + (b - points[4].position).norm();
      sag[axis] = (points[4].position - .5 * (a + b)).norm();
    }
    // Larger cells may have details that none of the nine points shows.
    const bool isSmall = length.maxCoeff() < .01 * diagonal;
    if (found == 0 && isSmall)
      return;
    if (found == 9 && isSmall && sag.maxCoeff() < 1e-4 * diagonal)
      add(points);
    else if (length.maxCoeff() < 5e-4 * diagonal) {
      SurfacePoint middle;
      if (at(lower + .5 * side, middle))
        add(points);
    } else {
      Eigen::Index axis;
      (found == 9 && isSmall ? sag : length).maxCoeff(&axis);
      Eigen::Array2d half = side, upper = lower;
      half[axis] *= .5;
      upper[axis] += half[axis];
      cut(lower, half);
      cut(upper, half);
    }
  }

private:
  /// \return true if the point is on the surface, not buried or cut away
  bool at(const Eigen::Array2d& place, SurfacePoint& point) const
  {
    Draw draw;
    draw.u = place[0];
    draw.v = place[1];
    return patch.at(draw, point) && std::abs(shape.distance(point.position)) < 1e-9 * diagonal;
  }

  void add(const std::array<SurfacePoint, 9>& points)
  {
    const auto first = static_cast<std::int32_t>(result.vertices.size());
    for (const int corner : {0, 2, 8, 6})
      result.vertices.push_back(points[corner].position);
    const Vector3d across = (points[8].position - points[0].position).cross(points[6].position - points[2].position);
    const std::int32_t turn = across.dot(points[4].normal) < 0 ? 1 : 0;
    result.triangles.push_back({first, first + 1 + turn, first + 2 - turn});
    result.triangles.push_back({first, first + 2 + turn, first + 3 - turn});
  }
};

} // namespace

Patch spherePatch(double radius, const Vector3d& center, double lowest)
{
  const auto at = [=](const Draw& draw, SurfacePoint& point) {
    const double z = lowest + (1 - lowest) * draw.u, across = std::sqrt(std::max(0.0, 1 - z * z));
    const SinCos around = sinCos(draw.v);
    point.normal = {across * around.cosine, across * around.sine, z};
    point.position = center + radius * point.normal;
    return true;
  };
  return {2 * pi * radius * radius * (1 - lowest), at};
}

Patch torusPatch(double majorRadius, double minorRadius, const Vector3d& center)
{
  const auto at = [=](const Draw& draw, SurfacePoint& point) {
    const SinCos tube = sinCos(draw.u), around = sinCos(draw.v);
    const double radius = majorRadius + minorRadius * tube.cosine;
    // Area is proportional to the distance from the axis.
    if (draw.accept * (majorRadius + minorRadius) > radius)
      return false;
    const Vector3d outwards(around.cosine, around.sine, 0);
    point.normal = tube.cosine * outwards + Vector3d(0, 0, tube.sine);
    point.position = center + radius * outwards + Vector3d(0, 0, minorRadius * tube.sine);
    return true;
  };
  return {4 * pi * pi * minorRadius * (majorRadius + minorRadius), at};
}

Patch cylinderPatch(const Vector3d& a, const Vector3d& b, double radius)
{
  const Vector3d axis = (b - a).normalized(), x = perpendicular(axis), y = axis.cross(x);
  const auto at = [=](const Draw& draw, SurfacePoint& point) {
    const SinCos around = sinCos(draw.v);
    point.normal = around.cosine * x + around.sine * y;
    point.position = a + draw.u * (b - a) + radius * point.normal;
    return true;
  };
  return {2 * pi * radius * (b - a).norm(), at};
}

Patch discPatch(const Vector3d& center, const Vector3d& normal, double radius)
{
  const Vector3d unit = normal.normalized(), x = perpendicular(unit), y = unit.cross(x);
  const auto at = [=](const Draw& draw, SurfacePoint& point) {
    const SinCos around = sinCos(draw.v);
    point.normal = unit;
    point.position = center + radius * std::sqrt(draw.u) * (around.cosine * x + around.sine * y);
    return true;
  };
  return {pi * radius * radius, at};
}

Patch rectanglePatch(const Vector3d& corner, const Vector3d& side1, const Vector3d& side2)
{
  const Vector3d normal = side1.cross(side2).normalized();
  const auto at = [=](const Draw& draw, SurfacePoint& point) {
    point.normal = normal;
    point.position = corner + draw.u * side1 + draw.v * side2;
    return true;
  };
  return {side1.cross(side2).norm(), at};
}

Patch reversed(const Patch& patch)
{
  const auto at = [forward = patch.at](const Draw& draw, SurfacePoint& point) {
    const bool isThere = forward(draw, point);
    point.normal = -point.normal;
    return isThere;
  };
  return {patch.area, at};
}

double leaves(const Box& box, const Vector3d& origin, const Vector3d& direction)
{
  // A millionth of the diagonal, because flat boxes have no thickness to be hit.
  const Vector3d margin = Vector3d::Constant(1e-6 * box.diagonal().norm());
  double enter = 0, leave = std::numeric_limits<double>::max();
  clip({box.min() - margin, box.max() + margin}, origin, inverseOf(direction), enter, leave);
  return enter <= leave ? leave : -1;
}

AnalyticSurface::AnalyticSurface(Shape shape) : shape_(std::move(shape))
{
  double total = 0;
  for (const Patch& patch : shape_.patches)
    areas_.push_back(total += patch.area);
}

Triangles AnalyticSurface::triangulate() const
{
  Triangles result;
  for (const Patch& patch : shape_.patches)
    Tessellation{shape_, patch, result}.cut({0, 0}, {1, 1});
  return result;
}

bool AnalyticSurface::sample(const Draw& draw, SurfacePoint& point) const
{
  const auto found = std::upper_bound(areas_.begin(), areas_.end(), draw.part * areas_.back());
  const std::size_t part = std::min(static_cast<std::size_t>(found - areas_.begin()), areas_.size() - 1);
  point.part = static_cast<std::int64_t>(part);
  if (!shape_.patches[part].at(draw, point))
    return false;
  // False if buried in another solid or cut away. The limit is far above rounding and far below visible details.
  return std::abs(shape_.distance(point.position)) < 1e-9 * shape_.box.diagonal().norm();
}

bool AnalyticSurface::isOccluded(const SurfacePoint& point, const Vector3d& from) const
{
  // Walks towards the point but not the last bit, where the distance falls to 0 because of the point itself.
  const double diagonal = shape_.box.diagonal().norm(), hit = 1e-7 * diagonal, last = 1e-4 * diagonal;
  const double length = (point.position - from).norm();
  const Vector3d direction = (point.position - from) / length;
  double walked = 0;
  for (int step = 0; step < 10000 && walked < length - last; ++step) {
    const double free = shape_.distance(from + walked * direction);
    if (free < hit)
      return true;
    walked += free;
  }
  return false;
}

bool AnalyticSurface::firstHit(const Vector3d& origin, const Vector3d& direction, SurfacePoint& point) const
{
  const double diagonal = shape_.box.diagonal().norm(), hit = 1e-10 * diagonal,
               last = leaves(shape_.box, origin, direction);
  double walked = 0, free = 0;
  for (int step = 0; step < 10000 && walked <= last; ++step) {
    free = shape_.distance(origin + walked * direction);
    if (free < hit)
      break;
    walked += free;
  }
  if (!(walked <= last) || free >= hit)
    return false;
  point.position = origin + walked * direction;
  // Outside of the box there is no surface, although the distance may be 0.
  const Vector3d margin = Vector3d::Constant(1e-6 * diagonal);
  if ((point.position - shape_.box.min() + margin).minCoeff() < 0 ||
      (shape_.box.max() - point.position + margin).minCoeff() < 0 || (shape_.isOpen && shape_.isOpen(point.position)))
    return false;
  // The rounding error of the differences is about 10⁻¹⁶/10⁻⁶.
  point.normal = shapes::normalOf(shape_.distance, point.position, 1e-6 * diagonal);
  return true;
}

} // namespace pcl::mrf::scan

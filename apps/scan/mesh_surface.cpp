// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_surface.h"

#include <pcl/surface/mrf/exceptions.h>
#include <shapes/portable_math.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace pcl {
namespace mrf {
namespace scan {

using Eigen::Vector3d;
using Corners = std::array<std::int32_t, 3>;

namespace {

const std::vector<Corners>& checked(const std::vector<Vector3d>& vertices, const std::vector<Corners>& triangles)
{
  for (const Vector3d& x : vertices)
    if (!x.allFinite())
      throw InvalidInput("the mesh has a vertex that is not finite");
  for (const Corners& t : triangles)
    for (const std::int32_t corner : t)
      if (corner < 0 || static_cast<std::size_t>(corner) >= vertices.size())
        throw InvalidInput("the mesh has a triangle with a corner of index " + std::to_string(corner) + ", but " +
                           std::to_string(vertices.size()) + " vertices");
  return triangles;
}

} // namespace

MeshSurface::MeshSurface(std::vector<Vector3d> vertices, std::vector<Corners> triangles)
    : vertices_(std::move(vertices)), triangles_(std::move(triangles)), tree_(vertices_, checked(vertices_, triangles_))
{
  if (triangles_.empty())
    throw InvalidInput("the mesh has no triangles");
  double total = 0;
  box_.lower = box_.upper = vertices_[static_cast<std::size_t>(triangles_[0][0])];
  for (const Corners& t : triangles_) {
    const Vector3d &a = vertices_[static_cast<std::size_t>(t[0])], &b = vertices_[static_cast<std::size_t>(t[1])],
                   &c = vertices_[static_cast<std::size_t>(t[2])];
    total += .5 * portable::norm(portable::cross(b - a, c - a));
    areas_.push_back(total);
    box_.lower = box_.lower.cwiseMin(a.cwiseMin(b).cwiseMin(c));
    box_.upper = box_.upper.cwiseMax(a.cwiseMax(b).cwiseMax(c));
  }
  if (!(total > 0) || !std::isfinite(total))
    throw InvalidInput("the mesh has no area");

  guide_.resize(triangles_.size());
  std::uint32_t triangle = 0;
  for (std::size_t i = 0; i < guide_.size(); ++i) {
    const double area = total * static_cast<double>(i) / static_cast<double>(guide_.size());
    while (triangle + 1 < areas_.size() && areas_[triangle] <= area)
      ++triangle;
    guide_[i] = triangle;
  }
  setVertexNormals();
}

void MeshSurface::setVertexNormals()
{
  const auto key = [&](std::int32_t v) {
    const Vector3d& x = vertices_[static_cast<std::size_t>(v)];
    return std::make_tuple(x.x(), x.y(), x.z(), v);
  };
  std::vector<std::int32_t> order(vertices_.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) { return key(a) < key(b); });
  std::vector<std::size_t> representative(vertices_.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto v = static_cast<std::size_t>(order[i]);
    const bool isCopy = i > 0 && vertices_[static_cast<std::size_t>(order[i - 1])] == vertices_[v];
    representative[v] = isCopy ? representative[static_cast<std::size_t>(order[i - 1])] : v;
  }
  std::vector<Vector3d> sums(vertices_.size(), Vector3d::Zero());
  for (const Corners& t : triangles_) {
    const Vector3d& a = vertices_[static_cast<std::size_t>(t[0])];
    const Vector3d doubleArea =
        portable::cross(vertices_[static_cast<std::size_t>(t[1])] - a, vertices_[static_cast<std::size_t>(t[2])] - a);
    for (const std::int32_t corner : t)
      sums[representative[static_cast<std::size_t>(corner)]] += doubleArea;
  }
  vertexNormals_.reserve(vertices_.size());
  for (const std::size_t v : representative)
    vertexNormals_.push_back(portable::unit(sums[v]));
}

std::size_t MeshSurface::triangleAt(double area) const
{
  const double share = area / areas_.back() * static_cast<double>(guide_.size());
  const std::size_t slot = std::min(guide_.size() - 1, static_cast<std::size_t>(share));
  // The slot before covers rounding at a slot's border.
  std::size_t triangle = guide_[slot > 0 ? slot - 1 : 0];
  while (triangle + 1 < areas_.size() && areas_[triangle] <= area)
    ++triangle;
  return triangle;
}

bool MeshSurface::sample(const Draw& draw, SurfacePoint& point) const
{
  const std::size_t triangle = triangleAt(draw.part * areas_.back());
  const auto [i, j, k] = triangles_[triangle];
  const auto at = [](const std::vector<Vector3d>& values, std::int32_t v) {
    return values[static_cast<std::size_t>(v)];
  };
  const Vector3d corner = at(vertices_, i), edge1 = at(vertices_, j) - corner, edge2 = at(vertices_, k) - corner;
  const double root = std::sqrt(draw.u), b = root * (1 - draw.v), c = root * draw.v;
  const Vector3d doubleArea = portable::cross(edge1, edge2);
  if (doubleArea.isZero(0))
    return false;
  point.position = corner + b * edge1 + c * edge2;
  point.normal = portable::unit(doubleArea);
  point.part = static_cast<std::int64_t>(triangle);

  // Derivatives of the interpolated normal along the two edges, after it is scaled to unit length.
  const Vector3d n0 = at(vertexNormals_, i), n1 = at(vertexNormals_, j) - n0, n2 = at(vertexNormals_, k) - n0;
  const Vector3d sum = n0 + b * n1 + c * n2;
  const double length = portable::norm(sum);
  point.tangents[0] = edge1;
  point.tangents[1] = edge2;
  if (length > .1) {
    const Vector3d direction = sum / length;
    point.displacementDirection = direction;
    point.normalChanges[0] = (n1 - portable::dot(n1, direction) * direction) / length;
    point.normalChanges[1] = (n2 - portable::dot(n2, direction) * direction) / length;
  } else {
    // The neighbors' normals cancel: a fold, which has no direction to be displaced along.
    point.displacementDirection = Vector3d::Zero();
    point.normalChanges[0] = point.normalChanges[1] = Vector3d::Zero();
  }
  return true;
}

bool MeshSurface::isOccluded(const SurfacePoint& point, const Vector3d& from) const
{
  const Vector3d ray = from - point.position;
  // The triangles around the point are not in its way; a millionth of the object is far above rounding.
  const double tMin = 1e-6 * box_.diagonal() / portable::norm(ray);
  return tree_.isHit(point.position, ray, tMin, point.part);
}

bool MeshSurface::firstHit(const Vector3d& origin, const Vector3d& direction, SurfacePoint& point) const
{
  const double last = box_.leaves(origin, direction);
  if (last < 0)
    return false;
  const TriangleTree::Hit hit = tree_.firstHit(origin, last * direction);
  if (hit.triangle < 0)
    return false;
  const auto [i, j, k] = triangles_[static_cast<std::size_t>(hit.triangle)];
  const Vector3d& corner = vertices_[static_cast<std::size_t>(i)];
  point.position = origin + hit.t * last * direction;
  point.normal = portable::unit(portable::cross(vertices_[static_cast<std::size_t>(j)] - corner,
                                                vertices_[static_cast<std::size_t>(k)] - corner));
  point.part = hit.triangle;
  return true;
}

} // namespace scan
} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_surface.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace pcl::mrf::scan {

using Eigen::Vector3d;
using Corners = std::array<std::int32_t, 3>;

/// Finds the triangle that the segment origin + t · direction, tMin < t < 1, meets first; of equally near ones that
/// with the smaller index.
struct MeshSurface::Segment {
  const MeshSurface& mesh;
  Vector3d origin, direction;
  double tMin = 0;
  std::int64_t excluded = -1; ///< a triangle to leave out
  bool isAnyEnough = false;   ///< any triangle will do, not only the first
  double t = 1;
  std::int64_t triangle = -1;
  Vector3d inverse = inverseOf(direction);

  bool intersectVolume(const Eigen::AlignedBox3d& box) const
  {
    double enter = 0, leave = t;
    clip(box, origin, inverse, enter, leave);
    // The margin covers the rounding of the products above.
    return enter <= leave + 1e-12;
  }

  /// Möller and Trumbore; a triangle seen exactly edge-on is not hit. \return true to end the search
  bool intersectObject(std::int32_t candidate)
  {
    const Facet facet = mesh.facet(candidate);
    const Vector3d p = direction.cross(facet.edge2), s = origin - facet.corner;
    const double determinant = facet.edge1.dot(p);
    if (determinant == 0 || candidate == excluded)
      return false;
    const double u = s.dot(p) / determinant;
    if (!(u >= 0 && u <= 1))
      return false;
    const Vector3d q = s.cross(facet.edge1);
    const double v = direction.dot(q) / determinant, meets = facet.edge2.dot(q) / determinant;
    if (!(v >= 0 && u + v <= 1 && meets > tMin && (meets < t || (meets == t && candidate < triangle))))
      return false;
    t = meets;
    triangle = candidate;
    return isAnyEnough;
  }
};

MeshSurface::MeshSurface(std::vector<Vector3d> vertices, std::vector<Corners> triangles)
    : vertices_(std::move(vertices)), triangles_(std::move(triangles))
{
  for (const Vector3d& x : vertices_)
    if (!x.allFinite())
      throw InvalidInput("the mesh has a vertex that is not finite");

  double total = 0;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Corners& t : triangles_) {
    Eigen::AlignedBox3d& box = boxes.emplace_back();
    for (const std::int32_t corner : t)
      box.extend(vertices_[corner]);
    box_.extend(box);
    total += .5 * facet(boxes.size() - 1).doubleArea().norm();
    areas_.push_back(total);
  }
  if (!(total > 0) || !std::isfinite(total))
    throw InvalidInput("the mesh has no area");
  std::vector<std::int32_t> order(triangles_.size());
  std::iota(order.begin(), order.end(), 0);
  tree_.init(order.begin(), order.end(), boxes.begin(), boxes.end());
}

MeshSurface::Facet MeshSurface::facet(std::size_t triangle) const
{
  const auto& [i, j, k] = triangles_[triangle];
  const Vector3d& corner = vertices_[i];
  return {corner, vertices_[j] - corner, vertices_[k] - corner};
}

bool MeshSurface::sample(const Draw& draw, SurfacePoint& point) const
{
  const auto found = std::upper_bound(areas_.begin(), areas_.end(), draw.part * areas_.back());
  const std::size_t triangle = std::min(static_cast<std::size_t>(found - areas_.begin()), areas_.size() - 1);
  const Facet sampled = facet(triangle);
  const double root = std::sqrt(draw.u);
  point.position = sampled.corner + root * (1 - draw.v) * sampled.edge1 + root * draw.v * sampled.edge2;
  point.normal = sampled.doubleArea().normalized();
  point.part = static_cast<std::int64_t>(triangle);
  return !sampled.doubleArea().isZero(0);
}

bool MeshSurface::isOccluded(const SurfacePoint& point, const Vector3d& from) const
{
  const Vector3d ray = from - point.position;
  // Triangles next to the point do not occlude it; a millionth of the diagonal is far above rounding.
  Segment segment{*this, point.position, ray, 1e-6 * box_.diagonal().norm() / ray.norm(), point.part, true};
  BVIntersect(tree_, segment);
  return segment.triangle >= 0;
}

bool MeshSurface::firstHit(const Vector3d& origin, const Vector3d& direction, SurfacePoint& point) const
{
  const double last = leaves(box_, origin, direction);
  if (last < 0)
    return false;
  Segment segment{*this, origin, last * direction};
  BVIntersect(tree_, segment);
  if (segment.triangle < 0)
    return false;
  point.position = origin + segment.t * last * direction;
  point.normal = facet(segment.triangle).doubleArea().normalized();
  point.part = segment.triangle;
  return true;
}

} // namespace pcl::mrf::scan

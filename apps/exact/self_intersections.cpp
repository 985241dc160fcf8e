// SPDX-License-Identifier: BSD-3-Clause
#include "self_intersections.h"

#include <CGAL/box_intersection_d.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>

namespace exact {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::size_t>;
using pcl::mrf::Triangle;

/// Rotates a triangle so that the corner comes first.
Triangle startingAt(const Triangle& triangle, int corner)
{
  const auto at = [&](int offset) { return triangle[(corner + offset) % 3]; };
  return {at(0), at(1), at(2)};
}

class PairTest {
public:
  explicit PairTest(const pcl::mrf::TriangleMesh& mesh) : triangles_(mesh.triangles)
  {
    for (const Eigen::Vector3f& x : mesh.vertices) {
      finite_.push_back(x.allFinite());
      points_.emplace_back(x.x(), x.y(), x.z());
    }
  }

  const Point& point(std::int32_t vertex) const { return points_[vertex]; }

  bool isFinite(const Triangle& t) const
  {
    return std::all_of(t.begin(), t.end(), [&](std::int32_t v) { return finite_[v]; });
  }

  bool isDegenerate(const Triangle& t) const { return CGAL::collinear(point(t[0]), point(t[1]), point(t[2])); }

  bool operator()(std::size_t first, std::size_t second) const
  {
    Triangle a = triangles_[first], b = triangles_[second];
    int common = 0, freeCorner = 0, sharedCorner = 0;
    for (int corner = 0; corner < 3; ++corner) {
      if (std::find(b.begin(), b.end(), a[corner]) != b.end()) {
        ++common;
        sharedCorner = corner;
      } else {
        freeCorner = corner;
      }
    }
    if (common == 3)
      return true;
    if (common == 2)
      return foldedOver(startingAt(a, freeCorner), b);
    if (common == 0)
      return CGAL::do_intersect(solid(a), solid(b));
    // An intersection beyond the common vertex starts there and leaves one of the triangles through the opposite edge.
    a = startingAt(a, sharedCorner);
    b = startingAt(b, static_cast<int>(std::find(b.begin(), b.end(), a[0]) - b.begin()));
    return CGAL::do_intersect(solid(a), Kernel::Segment_3(point(b[1]), point(b[2]))) ||
           CGAL::do_intersect(solid(b), Kernel::Segment_3(point(a[1]), point(a[2])));
  }

private:
  Kernel::Triangle_3 solid(const Triangle& t) const { return {point(t[0]), point(t[1]), point(t[2])}; }

  /// True if b lies in the plane of a, on the same side of the shared edge a[1] a[2].
  bool foldedOver(const Triangle& a, const Triangle& b) const
  {
    const auto isFree = [&](std::int32_t vertex) { return vertex != a[1] && vertex != a[2]; };
    const Point& opposite = point(*std::find_if(b.begin(), b.end(), isFree));
    return CGAL::coplanar(point(a[0]), point(a[1]), point(a[2]), opposite) &&
           CGAL::coplanar_orientation(point(a[1]), point(a[2]), point(a[0]), opposite) == CGAL::POSITIVE;
  }

  std::vector<bool> finite_;
  std::vector<Point> points_;
  const std::vector<Triangle>& triangles_;
};

} // namespace

std::vector<std::int32_t> degenerateTriangles(const pcl::mrf::TriangleMesh& mesh)
{
  const PairTest test(mesh);
  std::vector<std::int32_t> result;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (test.isFinite(mesh.triangles[t]) && test.isDegenerate(mesh.triangles[t]))
      result.push_back(static_cast<std::int32_t>(t));
  return result;
}

std::vector<std::int32_t> selfIntersectingTriangles(const pcl::mrf::TriangleMesh& mesh)
{
  const PairTest intersects(mesh);
  std::vector<std::uint8_t> hit(mesh.triangles.size(), 0);
  std::vector<Box> boxes;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& triangle = mesh.triangles[t];
    if (!intersects.isFinite(triangle))
      continue;
    if (intersects.isDegenerate(triangle))
      hit[t] = 1;
    else
      boxes.emplace_back(intersects.point(triangle[0]).bbox() + intersects.point(triangle[1]).bbox() +
                             intersects.point(triangle[2]).bbox(),
                         t);
  }
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
    if (intersects(a.info(), b.info()))
      hit[a.info()] = hit[b.info()] = 1;
  });
  std::vector<std::int32_t> result;
  for (std::size_t t = 0; t < hit.size(); ++t)
    if (hit[t])
      result.push_back(static_cast<std::int32_t>(t));
  return result;
}

} // namespace exact

// SPDX-License-Identifier: BSD-3-Clause
#include "triangle_tree.h"

#include <shapes/portable_math.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace pcl {
namespace mrf {
namespace scan {

using Eigen::Vector3d;
using Corners = std::array<std::int32_t, 3>;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr int bins = 16;
constexpr std::int32_t leafSize = 4;
constexpr int maxDepth = 60; ///< of the traversal's stack

struct Bounds {
  Vector3d lower = Vector3d::Constant(infinity);
  Vector3d upper = Vector3d::Constant(-infinity);

  void add(const Vector3d& x)
  {
    lower = lower.cwiseMin(x);
    upper = upper.cwiseMax(x);
  }
  void add(const Bounds& other)
  {
    lower = lower.cwiseMin(other.lower);
    upper = upper.cwiseMax(other.upper);
  }
  double area() const
  {
    const Vector3d side = (upper - lower).cwiseMax(0);
    return side.x() * side.y() + side.y() * side.z() + side.z() * side.x();
  }
};

} // namespace

struct TriangleTree::Builder {
  TriangleTree& tree;
  std::vector<Bounds> bounds; ///< per triangle
  std::vector<Vector3d> centers;
  std::vector<std::int32_t> order;

  /// Where to cut a range of triangles, -1 axis if it is better left whole.
  struct Cut {
    int axis = -1;
    double position = 0;
  };

  Cut findCut(std::int32_t begin, std::int32_t end, const Bounds& node) const
  {
    Bounds centroids;
    for (std::int32_t i = begin; i < end; ++i)
      centroids.add(centers[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])]);
    const Vector3d extent = centroids.upper - centroids.lower;
    // Costs in units of one triangle test times the node's area; a step down costs about one test.
    double best = (end - begin) * node.area();
    const double step = node.area();
    Cut cut;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(extent[axis] > 0))
        continue;
      std::array<Bounds, bins> binBounds;
      std::array<std::int32_t, bins> binCounts{};
      const double scale = bins / extent[axis];
      for (std::int32_t i = begin; i < end; ++i) {
        const auto t = static_cast<std::size_t>(order[static_cast<std::size_t>(i)]);
        const int bin = std::min(bins - 1, static_cast<int>((centers[t][axis] - centroids.lower[axis]) * scale));
        binBounds[static_cast<std::size_t>(bin)].add(bounds[t]);
        ++binCounts[static_cast<std::size_t>(bin)];
      }
      std::array<double, bins> rightCost{};
      Bounds right;
      std::int32_t rightCount = 0;
      for (std::size_t bin = bins - 1; bin > 0; --bin) {
        right.add(binBounds[bin]);
        rightCount += binCounts[bin];
        rightCost[bin] = rightCount > 0 ? rightCount * right.area() : infinity;
      }
      Bounds left;
      std::int32_t leftCount = 0;
      for (std::size_t bin = 0; bin + 1 < bins; ++bin) {
        left.add(binBounds[bin]);
        leftCount += binCounts[bin];
        const double cost = leftCount > 0 ? leftCount * left.area() + rightCost[bin + 1] + step : infinity;
        if (cost < best) {
          best = cost;
          cut = {axis, centroids.lower[axis] + static_cast<double>(bin + 1) / scale};
        }
      }
    }
    return cut;
  }

  void build(std::size_t node, std::int32_t begin, std::int32_t end, int depth)
  {
    Bounds box;
    for (std::int32_t i = begin; i < end; ++i)
      box.add(bounds[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      constexpr float limit = std::numeric_limits<float>::infinity();
      tree.nodes_[node].lower[axis] = std::nextafter(static_cast<float>(box.lower[a]), -limit);
      tree.nodes_[node].upper[axis] = std::nextafter(static_cast<float>(box.upper[a]), limit);
    }
    tree.nodes_[node].first = begin;
    tree.nodes_[node].count = end - begin;
    if (end - begin <= leafSize || depth == maxDepth)
      return;

    const Cut cut = findCut(begin, end, box);
    auto middle = order.begin() + begin;
    if (cut.axis >= 0)
      middle = std::partition(order.begin() + begin, order.begin() + end, [&](std::int32_t t) {
        return centers[static_cast<std::size_t>(t)][cut.axis] < cut.position;
      });
    auto left = static_cast<std::int32_t>(middle - order.begin());
    if (left == begin || left == end) {
      if (end - begin <= 4 * leafSize)
        return;
      // Rounding at a bin's border, or many triangles with one centroid: halves keep the tree shallow.
      left = begin + (end - begin) / 2;
    }
    const std::size_t children = tree.nodes_.size();
    tree.nodes_.resize(children + 2);
    tree.nodes_[node].first = static_cast<std::int32_t>(children);
    tree.nodes_[node].count = 0;
    build(children, begin, left, depth + 1);
    build(children + 1, left, end, depth + 1);
  }
};

TriangleTree::TriangleTree(const std::vector<Vector3d>& vertices, const std::vector<Corners>& triangles)
{
  if (triangles.empty())
    return;
  Builder builder{*this, {}, {}, {}};
  for (const Corners& t : triangles) {
    Bounds box;
    for (const std::int32_t corner : t)
      box.add(vertices[static_cast<std::size_t>(corner)]);
    builder.bounds.push_back(box);
    builder.centers.push_back(.5 * (box.lower + box.upper));
  }
  builder.order.resize(triangles.size());
  std::iota(builder.order.begin(), builder.order.end(), 0);
  nodes_.resize(1);
  builder.build(0, 0, static_cast<std::int32_t>(triangles.size()), 0);
  facets_.reserve(triangles.size());
  for (const std::int32_t index : builder.order) {
    const Corners& t = triangles[static_cast<std::size_t>(index)];
    const Vector3d& corner = vertices[static_cast<std::size_t>(t[0])];
    facets_.push_back({corner, vertices[static_cast<std::size_t>(t[1])] - corner,
                       vertices[static_cast<std::size_t>(t[2])] - corner, index});
  }
}

double TriangleTree::meets(const Facet& facet, const Vector3d& origin, const Vector3d& direction)
{
  // Möller and Trumbore; a triangle seen exactly edge-on is not hit.
  constexpr double nowhere = 2;
  const Vector3d p = portable::cross(direction, facet.edge2);
  const double determinant = portable::dot(facet.edge1, p);
  if (determinant == 0)
    return nowhere;
  const double inverse = 1 / determinant;
  const Vector3d s = origin - facet.corner;
  const double u = portable::dot(s, p) * inverse;
  if (!(u >= 0 && u <= 1))
    return nowhere;
  const Vector3d q = portable::cross(s, facet.edge1);
  const double v = portable::dot(direction, q) * inverse;
  if (!(v >= 0 && u + v <= 1))
    return nowhere;
  return portable::dot(facet.edge2, q) * inverse;
}

/// A segment against boxes.
struct TriangleTree::Ray {
  std::array<double, 3> start, inverse;

  Ray(const Vector3d& origin, const Vector3d& direction)
  {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      start[axis] = origin[static_cast<Eigen::Index>(axis)];
      // A huge number instead of infinity: 0 · ∞ would be NaN for a segment in the plane of a box's face.
      const double d = direction[static_cast<Eigen::Index>(axis)];
      inverse[axis] = std::abs(d) > 1e-300 ? 1 / d : 1e300;
    }
  }

  /// Whether it passes through the node's box before t.
  bool meets(const Node& node, double t) const
  {
    double enter = 0, leave = t;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double a = (static_cast<double>(node.lower[axis]) - start[axis]) * inverse[axis];
      const double b = (static_cast<double>(node.upper[axis]) - start[axis]) * inverse[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    // The margin covers the rounding of the products above.
    return enter <= leave + 1e-12;
  }
};

template <typename Visit>
void TriangleTree::traverse(const Vector3d& origin, const Vector3d& direction, const Visit& visit) const
{
  if (nodes_.empty())
    return;
  const Ray ray(origin, direction);
  double end = 1;
  std::array<std::int32_t, maxDepth + 4> stack;
  std::size_t top = 0;
  stack[top++] = 0;
  while (top > 0 && end > 0) {
    const Node& node = nodes_[static_cast<std::size_t>(stack[--top])];
    if (!ray.meets(node, end))
      continue;
    if (node.count == 0) {
      stack[top++] = node.first;
      stack[top++] = node.first + 1;
      continue;
    }
    for (std::int32_t i = node.first; i < node.first + node.count; ++i) {
      const Facet& facet = facets_[static_cast<std::size_t>(i)];
      end = std::min(end, visit(facet.triangle, meets(facet, origin, direction)));
    }
  }
}

bool TriangleTree::isHit(const Vector3d& origin, const Vector3d& direction, double tMin, std::int64_t excluded) const
{
  bool isHit = false;
  traverse(origin, direction, [&](std::int64_t triangle, double t) {
    isHit = isHit || (triangle != excluded && t > tMin && t < 1);
    return isHit ? 0. : 1.;
  });
  return isHit;
}

TriangleTree::Hit TriangleTree::firstHit(const Vector3d& origin, const Vector3d& direction) const
{
  Hit first;
  traverse(origin, direction, [&](std::int64_t triangle, double t) {
    if (t > 0 && (t < first.t || (t == first.t && triangle < first.triangle)))
      first = {t, triangle};
    return first.t;
  });
  return first;
}

} // namespace scan
} // namespace mrf
} // namespace pcl

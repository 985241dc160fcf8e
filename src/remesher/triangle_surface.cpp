// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/triangle_surface.h"

#include "base/select_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int32_t leafSize = 4;

bool isUsable(const TriangleMesh& mesh, const Triangle& triangle)
{
  return std::all_of(triangle.begin(), triangle.end(), [&](std::int32_t v) {
    return v >= 0 && static_cast<std::size_t>(v) < mesh.vertices.size() && mesh.vertices[v].allFinite();
  });
}

/// Weights of the ends of a segment for the point of it that is nearest to the query.
std::pair<float, float> weightsOnSegment(const Vector3f& query, const Vector3f& from, const Vector3f& to)
{
  const Vector3f along = to - from;
  const float length = along.squaredNorm();
  const float share = length > 0 ? std::clamp((query - from).dot(along) / length, 0.f, 1.f) : 0;
  return {1 - share, share};
}

/// Weights of the corners for the point of their triangle that is nearest to the query: the foot of the perpendicular
/// if it is inside, else the nearest on one of the sides.
Vector3f nearestWeights(const Vector3f& query, const std::array<Vector3f, 3>& corners)
{
  const Vector3f normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const float area = normal.squaredNorm();
  if (area > 0) {
    Vector3f weights;
    for (int n = 0; n < 3; ++n) {
      const Vector3f &next = corners[(n + 1) % 3], &last = corners[(n + 2) % 3];
      weights[n] = (last - next).cross(query - next).dot(normal) / area;
    }
    if (weights.minCoeff() >= 0)
      return weights / weights.sum();
  }
  Vector3f best = Vector3f::Zero();
  float distance = std::numeric_limits<float>::infinity();
  for (int n = 0; n < 3; ++n) {
    const int m = (n + 1) % 3;
    const Vector3f &from = corners[n], &to = corners[m];
    const auto [ofFrom, ofTo] = weightsOnSegment(query, from, to);
    const float squared = (ofFrom * from + ofTo * to - query).squaredNorm();
    if (squared < distance) {
      distance = squared;
      best = Vector3f::Zero();
      best[n] = ofFrom;
      best[m] = ofTo;
    }
  }
  return best;
}

/// Of the triangles around each vertex, by their areas; zero where there are none.
std::vector<Vector3f> vertexNormals(const TriangleMesh& mesh)
{
  std::vector<Vector3f> normals(mesh.vertices.size(), Vector3f::Zero());
  for (const Triangle& t : mesh.triangles) {
    if (!isUsable(mesh, t))
      continue;
    const auto at = [&](std::size_t n) { return mesh.vertices[t[n]]; };
    const Vector3f normal = (at(1) - at(0)).cross(at(2) - at(0));
    for (const std::int32_t v : t)
      normals[v] += normal;
  }
  for (Vector3f& normal : normals)
    normal = normal.norm() > 0 ? Vector3f(normal.normalized()) : Vector3f::Zero();
  return normals;
}

} // namespace

TriangleSurface::TriangleSurface(const TriangleMesh& mesh, float maxStep)
    : ReferenceSurface(maxStep), mesh_(mesh),
      normals_(mesh.normals.size() == mesh.vertices.size() ? mesh.normals : vertexNormals(mesh))
{
  std::vector<Vector3f> centers(mesh.triangles.size(), Vector3f::Zero());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!isUsable(mesh, mesh.triangles[t]))
      continue;
    const auto triangle = static_cast<std::int32_t>(t);
    centers[t] = (corner(triangle, 0) + corner(triangle, 1) + corner(triangle, 2)) / 3;
    order_.push_back(triangle);
  }
  if (!order_.empty())
    build(0, static_cast<std::int32_t>(order_.size()), centers);
}

const Vector3f& TriangleSurface::corner(std::int32_t triangle, std::size_t number) const
{
  return mesh_.vertices[mesh_.triangles[triangle][number]];
}

void TriangleSurface::build(std::int32_t begin, std::int32_t end, const std::vector<Vector3f>& centers)
{
  const std::size_t own = nodes_.size();
  Node node{corner(order_[begin], 0), corner(order_[begin], 0), 0, 0};
  for (std::int32_t n = begin; n < end; ++n)
    for (std::size_t c = 0; c < 3; ++c) {
      node.lower = node.lower.cwiseMin(corner(order_[n], c));
      node.upper = node.upper.cwiseMax(corner(order_[n], c));
    }
  nodes_.push_back(node);
  if (end - begin <= leafSize) {
    nodes_[own].begin = begin;
    nodes_[own].end = end;
    return;
  }
  Eigen::Index axis = 0;
  (node.upper - node.lower).maxCoeff(&axis);
  const std::int32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::int32_t a, std::int32_t b) {
                     const float ofA = centers[a][axis], ofB = centers[b][axis];
                     return ofA < ofB || (ofA == ofB && a < b);
                   });
  build(begin, middle, centers);
  nodes_[own].right = static_cast<std::int32_t>(nodes_.size());
  build(middle, end, centers);
}

void TriangleSurface::offer(std::int32_t triangle, const Vector3f& query, Place& nearest) const
{
  const std::array<Vector3f, 3> corners = {corner(triangle, 0), corner(triangle, 1), corner(triangle, 2)};
  const Vector3f weights = nearestWeights(query, corners);
  const Vector3f point = weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2];
  const float squared = (point - query).squaredNorm();
  if (squared < nearest.squaredDistance)
    nearest = {squared, triangle, weights};
}

TriangleSurface::Place TriangleSurface::nearest(const Vector3f& query, float limit) const
{
  Place result{limit};
  if (nodes_.empty() || !query.allFinite())
    return result;
  // A tree of halves over 2³¹ triangles at most has 31 levels, each of which leaves one node behind.
  std::array<std::int32_t, 40> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  const auto distanceTo = [&](std::int32_t number) {
    const Node& node = nodes_[number];
    return (query.cwiseMax(node.lower).cwiseMin(node.upper) - query).squaredNorm();
  };
  while (depth > 0) {
    const std::int32_t number = stack[--depth];
    if (!(distanceTo(number) < result.squaredDistance))
      continue;
    const Node& node = nodes_[number];
    for (std::int32_t n = node.begin; n < node.end; ++n)
      offer(order_[n], query, result);
    if (node.right == 0)
      continue;
    const std::int32_t left = number + 1;
    const bool isLeftNearer = distanceTo(left) <= distanceTo(node.right);
    stack[depth++] = isLeftNearer ? node.right : left;
    stack[depth++] = isLeftNearer ? left : node.right;
  }
  return result;
}

Vector3f TriangleSurface::normalOf(const Place& place) const
{
  Vector3f sum = Vector3f::Zero();
  const Triangle& triangle = mesh_.triangles[place.triangle];
  for (int n = 0; n < 3; ++n)
    sum += place.weights[n] * normals_[triangle[n]];
  const float length = sum.norm();
  return length > 1e-6f ? Vector3f(sum / length) : Vector3f::Zero();
}

Vector3f TriangleSurface::normalAt(const Vector3f& position, const Vector3f& fallback) const
{
  const Place place = nearest(position, std::numeric_limits<float>::infinity());
  const Vector3f normal = place.triangle < 0 ? Vector3f::Zero() : normalOf(place);
  return normal.isZero(0) ? fallback : normal;
}

std::optional<Corner> TriangleSurface::trace(const Vector3f& start) const
{
  const Place place = nearest(start, maxStep() * maxStep());
  if (place.triangle < 0)
    return {};
  const Vector3f normal = normalOf(place);
  if (normal.isZero(0))
    return {};
  return Corner{place.weights[0] * corner(place.triangle, 0) + place.weights[1] * corner(place.triangle, 1) +
                    place.weights[2] * corner(place.triangle, 2),
                normal};
}

float TriangleSurface::height(const Vector3f& position) const
{
  const std::optional<Corner> foot = trace(position);
  return foot ? foot->normal.dot(position - foot->position) : 0;
}

float medianEdge(const TriangleMesh& mesh)
{
  std::vector<float> lengths;
  lengths.reserve(3 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    if (isUsable(mesh, t))
      for (std::size_t n = 0; n < 3; ++n)
        lengths.push_back((mesh.vertices[t[(n + 1) % 3]] - mesh.vertices[t[n]]).squaredNorm());
  if (lengths.empty())
    return 0;
  return std::sqrt(median(std::move(lengths)));
}

} // namespace pcl::mrf

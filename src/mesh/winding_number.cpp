// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/winding_number.h"

#include "base/spatial_sort.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace pcl::mrf {
namespace {

constexpr std::int32_t trianglesOfLeaf = 4;

/// A group is distant from this many of its radii on: the error of its dipole is then some hundredths at most.
constexpr float radiiOfFar = 2.5f;

} // namespace

WindingNumber::WindingNumber(const TriangleMesh& mesh, Execution& execution) : mesh_(mesh)
{
  std::vector<Eigen::Vector3f> centers;
  centers.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    centers.push_back((mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3);
  order_ = spatialOrder(centers, std::vector<std::uint8_t>(centers.size(), 1), execution);
  if (!order_.empty())
    build(0, static_cast<std::int32_t>(order_.size()));
}

void WindingNumber::build(std::int32_t begin, std::int32_t end)
{
  const std::size_t number = nodes_.size();
  Node node;
  node.begin = begin;
  node.end = end;
  const auto forCorners = [&](const auto& body) {
    for (std::int32_t n = begin; n < end; ++n)
      for (const std::int32_t v : mesh_.triangles[order_[n]])
        body(mesh_.vertices[v]);
  };
  forCorners([&](const Eigen::Vector3f& corner) { node.center += corner; });
  node.center /= static_cast<float>(3 * (end - begin));
  forCorners([&](const Eigen::Vector3f& corner) {
    node.radius = std::max(node.radius, (corner - node.center).squaredNorm());
  });
  node.radius = std::sqrt(node.radius);
  for (std::int32_t n = begin; n < end; ++n) {
    const Triangle& t = mesh_.triangles[order_[n]];
    const Eigen::Vector3f& a = mesh_.vertices[t[0]];
    node.areaVector += (mesh_.vertices[t[1]] - a).cross(mesh_.vertices[t[2]] - a) / 2;
  }
  nodes_.push_back(node);
  if (end - begin > trianglesOfLeaf) {
    const std::int32_t middle = begin + (end - begin) / 2;
    build(begin, middle);
    build(middle, end);
  }
  nodes_[number].next = static_cast<std::int32_t>(nodes_.size());
}

/// Van Oosterom and Strackee 1983.
double WindingNumber::solidAngle(std::int32_t triangle, const Eigen::Vector3f& place) const
{
  const Triangle& t = mesh_.triangles[order_[triangle]];
  const auto to = [&](int corner) -> Eigen::Vector3d { return (mesh_.vertices[t[corner]] - place).cast<double>(); };
  const Eigen::Vector3d a = to(0), b = to(1), c = to(2);
  const double lengthA = a.norm(), lengthB = b.norm(), lengthC = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)),
                        lengthA * lengthB * lengthC + a.dot(b) * lengthC + b.dot(c) * lengthA + c.dot(a) * lengthB);
}

double WindingNumber::at(const Eigen::Vector3f& place) const
{
  double angle = 0;
  for (std::size_t n = 0; n < nodes_.size();) {
    const Node& node = nodes_[n];
    const Eigen::Vector3f to = node.center - place;
    const float squared = to.squaredNorm();
    if (squared > radiiOfFar * radiiOfFar * node.radius * node.radius)
      angle += static_cast<double>(node.areaVector.dot(to) / (squared * std::sqrt(squared)));
    else if (node.end - node.begin > trianglesOfLeaf) {
      ++n;
      continue;
    } else
      for (std::int32_t i = node.begin; i < node.end; ++i)
        angle += solidAngle(i, place);
    n = static_cast<std::size_t>(node.next);
  }
  return angle / static_cast<double>(4 * EIGEN_PI);
}

} // namespace pcl::mrf

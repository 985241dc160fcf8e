// SPDX-License-Identifier: BSD-3-Clause
#include "support/mesh_distance.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <cmath>

std::vector<double> distancesToMesh(const std::vector<Eigen::Vector3d>& points, const pcl::mrf::TriangleMesh& mesh)
{
  using Kernel = CGAL::Simple_cartesian<double>;
  using Iterator = std::vector<Kernel::Triangle_3>::const_iterator;
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, Iterator>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

  std::vector<Kernel::Triangle_3> triangles;
  const auto corner = [&](std::int32_t v) {
    const Eigen::Vector3f& p = mesh.vertices[static_cast<std::size_t>(v)];
    return Kernel::Point_3(p.x(), p.y(), p.z());
  };
  for (const pcl::mrf::Triangle& t : mesh.triangles)
    triangles.emplace_back(corner(t[0]), corner(t[1]), corner(t[2]));

  Tree tree(triangles.cbegin(), triangles.cend());
  tree.accelerate_distance_queries();
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const Eigen::Vector3d& p : points)
    distances.push_back(std::sqrt(tree.squared_distance(Kernel::Point_3(p.x(), p.y(), p.z()))));
  return distances;
}

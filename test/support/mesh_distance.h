// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Exact distances from points to a triangle mesh, by CGAL's AABB tree.
#pragma once

#include <pcl/surface/mrf/triangle_mesh.h>

#include <vector>

/// Distance from each point to the closest point of the mesh, in the order of the points.
std::vector<double> distancesToMesh(const std::vector<Eigen::Vector3d>& points, const pcl::mrf::TriangleMesh& mesh);

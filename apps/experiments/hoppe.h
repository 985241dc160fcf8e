// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief PCL's marching cubes after Hoppe, of plain points.
#pragma once

#include "support/surface_mesh.h"

#include <vector>

namespace mrf_apps {

/// pcl::MarchingCubesHoppe on a grid of `resolution`³ that is 5 % larger than the points' box, which is what lets it
/// close surfaces that touch the box; apart from that its own defaults. In a frame about the first point. PCL gives
/// every triangle its own corners: those of one place become one vertex.
/// \throw pcl::mrf::InvalidInput if it gives no surface
SurfaceMesh marchingCubesHoppe(const std::vector<Eigen::Vector3d>& positions,
                               const std::vector<Eigen::Vector3d>& normals, int resolution);

/// The mesh with one vertex for all within a distance of each other, without the triangles that collapse: for the
/// corners that several triangles computed on their own.
SurfaceMesh mergeClose(const SurfaceMesh& mesh, double distance);

} // namespace mrf_apps

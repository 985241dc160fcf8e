// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Checks and statistics of triangle meshes: validity, topology, triangle quality.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <array>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Component of each triangle, connected over shared edges; components are numbered by their first triangle;
/// −1 for triangles with a repeated vertex or an index out of range.
/// \return number of components
std::int32_t connectedComponents(const TriangleMesh& mesh, std::vector<std::int32_t>& componentOfTriangle);

} // namespace pcl::mrf

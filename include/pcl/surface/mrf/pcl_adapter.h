// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What MRFReconstruction does alike for all types of points: PCL's meshes and log, and answers of its searches.
#pragma once

#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/reconstruction.h>
#include <pcl/surface/mrf/report.h>

#include <pcl/PCLHeader.h>
#include <pcl/PolygonMesh.h>
#include <pcl/Vertices.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {
namespace detail {

/// Fields of a mesh's vertices beside x y z, normal_x normal_y normal_z and confidence; all are float32.
struct VertexFields {
  bool rgb = false;
  bool intensity = false;
  bool sigma = false; ///< and sigma_calibrated
};

/// Leaves no vertex and no triangle, but the header and the fields.
PCL_MRF_EXPORT void clear(pcl::PolygonMesh& output, const PCLHeader& header, const VertexFields& fields);

/// Writes the mesh of a result, in the cloud's frame. \pre clear(output, …) with the fields that the result has
PCL_MRF_EXPORT void write(const Reconstruction& result, pcl::PolygonMesh& output);

PCL_MRF_EXPORT void write(const std::vector<Triangle>& triangles, std::vector<pcl::Vertices>& polygons);

/// Warnings and failure go to PCL's console.
PCL_MRF_EXPORT void log(const Report& report) noexcept;

/// What a search object of PCL's answered, nearest first. \param found what it said it found \param max what it was
/// asked for \param positions how many it searches \return found
/// \throw InvalidInput if it is no answer: the stages use indices as they are
PCL_MRF_EXPORT int checkedAnswer(int found, int max, std::size_t positions, Neighbors& answer);

/// As in PCL's field rgb, without alpha.
inline std::uint32_t packRgb(const Rgb& rgb)
{
  return static_cast<std::uint32_t>(rgb[0]) << 16 | static_cast<std::uint32_t>(rgb[1]) << 8 | rgb[2];
}

} // namespace detail
} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Files of meshes with all fields of their vertices; PCL's writers leave out `confidence` and what else they do
/// not know.
#pragma once

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/export.h>

#include <pcl/PolygonMesh.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pcl {
namespace mrf {

/// Saves a mesh as binary PLY with all fields of its cloud: normal_x as nx, as is usual in PLY, rgb or rgba as red,
/// green and blue, and others under their own names, which pcl::io::loadPLYFile gives back.
///
/// The file appears whole or not at all: it is written under another name in the same folder, then renamed. What is no
/// regular file, such as /dev/stdout, is written to as it comes.
/// \return 0, or −1 after a PCL_ERROR that names the file and the reason, as PCL's own writers do
PCL_MRF_EXPORT int savePLY(const std::string& path, const pcl::PolygonMesh& mesh);

/// The same as binary VTK (legacy): the normals are the point data's normals, the colors its scalars, or else the first
/// of the other fields is; all of these are arrays of their own names.
PCL_MRF_EXPORT int saveVTK(const std::string& path, const pcl::PolygonMesh& mesh);

/// One value per vertex, wherever it lies in memory.
struct VertexField {
  /// One word: x, y, z, nx, ny, nz, red, green and blue mean what they say, all else is a scalar.
  std::string name;
  const void* values = nullptr; ///< of the first vertex
  std::size_t stride = 0;       ///< bytes from a vertex's value to the next one's
  std::uint8_t type = 0;        ///< of pcl::PCLPointField, such as FLOAT32
};

/// A mesh that somebody else holds.
struct MeshView {
  std::size_t vertices = 0, polygons = 0;
  std::vector<VertexField> fields; ///< x, y and z are among them
  /// Replaces the second argument by the vertices of a polygon.
  std::function<void(std::size_t, std::vector<std::int32_t>&)> corners;
  bool inSinglePrecision = false; ///< values in double precision are written as floats
};

/// Writes a mesh to a path, which has a part of it after an error. PLY has no 64-bit whole numbers: they become
/// doubles. \throw FileError if it cannot be written, or the mesh has no x, y and z or a polygon of vertices that it
/// has not
PCL_MRF_EXPORT void writePLY(const MeshView& mesh, const std::string& path);

/// The same as VTK.
PCL_MRF_EXPORT void writeVTK(const MeshView& mesh, const std::string& path);

} // namespace mrf
} // namespace pcl

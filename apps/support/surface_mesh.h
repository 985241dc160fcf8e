// SPDX-License-Identifier: BSD-3-Clause
/// A triangle mesh with vertex fields, and the files of meshes and distance fields that the tools write.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace pcl::mrf {
class DistanceField;
struct Reconstruction;
} // namespace pcl::mrf

namespace mrf_apps {

/// Optional arrays are either empty or as long as `vertices`.
struct SurfaceMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;
  std::vector<Eigen::Vector3f> normals;
  std::vector<float> confidences;
  std::vector<std::array<std::uint8_t, 3>> colors;
  std::vector<float> intensities;
  std::map<std::string, std::vector<float>> scalars; ///< further fields by name, one word each
  bool doublePrecision = false; ///< float does not hold the vertices: formats that can are written in double
};

/// Takes over the mesh of a reconstruction, in the cloud's frame. \param isExact float does not hold that
SurfaceMesh toSurfaceMesh(pcl::mrf::Reconstruction& reconstruction, bool isExact);

/// Formats that `writeMesh` knows: extensions in lower case, without the dot.
const std::vector<std::string>& meshFormats();

/// True if `writeMesh` knows the extension (lower case, without the dot).
bool isMeshFormat(const std::string& extension);

/// Extensions that writeMesh knows, for messages.
extern const char* const meshFileExtensions;

/// What a file of this mesh leaves off the vertices where the coordinates of its format are floats: near the mesh's
/// center, in few digits, or zero unless the mesh has doublePrecision.
Eigen::Vector3d offsetOfFloats(const SurfaceMesh& mesh, const std::string& format);

/// What a user should know about a file that was written less such an offset.
std::string shiftWarning(const std::string& path, const Eigen::Vector3d& offset);

/// Precedes the offset at the beginning of such a file, where readMesh finds it.
extern const char* const stlOffsetMark;

/// Writes PLY (binary), OBJ, STL (binary), VTK (legacy, binary), VTP, GLB, DAE or 3MF.
/// STL holds float coordinates, less offsetOfFloats, and no fields; the last three such coordinates; only PLY, VTK and
/// VTP scalars, and 3MF no colors.
/// \param format extension, lower case, without the dot
/// \throw pcl::mrf::FileError
void writeMesh(const SurfaceMesh& mesh, const std::string& path, const std::string& format);

/// The same for all formats but VTP, which needs VTK. \return false for another one, of which nothing is written
bool writeWithoutVtk(const SurfaceMesh& mesh, const std::string& path, const std::string& format);

/// Writes a field as an image of VTK, VTI, with the point arrays `distance` and `confidence`.
/// \param offset of the field's frame in the cloud's; becomes part of the image's origin \throw pcl::mrf::FileError
void writeField(const pcl::mrf::DistanceField& field, const Eigen::Vector3d& offset, const std::string& path);

} // namespace mrf_apps

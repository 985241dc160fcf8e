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
  std::map<std::string, std::vector<float>> scalars; ///< further fields by their names, which have no blanks
  bool doublePrecision = false; ///< float is too coarse for the vertices: formats that hold doubles get doubles
};

/// Moves the mesh out of a reconstruction, into the cloud's frame. \param isExact float does not hold its vertices
SurfaceMesh toSurfaceMesh(pcl::mrf::Reconstruction& reconstruction, bool isExact);

/// Formats that `writeMesh` knows: extensions in lower case, without the dot.
extern const std::vector<std::string> meshFormats;

/// The offset that is subtracted from the vertices if the format has float coordinates: near the mesh's center, in few
/// digits. Zero unless the mesh has doublePrecision.
Eigen::Vector3d offsetOfFloats(const SurfaceMesh& mesh, const std::string& format);

/// The warning about a file that was written with such an offset.
std::string shiftWarning(const std::string& path, const Eigen::Vector3d& offset);

/// The text before the offset in the header of an STL file, by which readMesh finds it.
extern const char* const stlOffsetMark;

/// Writes PLY (binary), OBJ, STL (binary), VTK (legacy, binary), VTP, GLB, DAE or 3MF. STL, GLB, DAE and 3MF hold float
/// coordinates minus offsetOfFloats; STL holds no fields, 3MF no colors, and only PLY, VTK and VTP hold scalars.
/// \param format extension, lower case, without the dot
/// \throw pcl::mrf::FileError
void writeMesh(const SurfaceMesh& mesh, const std::string& path, const std::string& format);

/// The same for all formats but VTP, which needs VTK. \return false for VTP and unknown formats, and writes nothing
bool writeWithoutVtk(const SurfaceMesh& mesh, const std::string& path, const std::string& format);

/// Writes a field as an image of VTK, VTI, with the point arrays `distance` and `confidence`.
/// \param offset of the field's frame in the cloud's; becomes part of the image's origin \throw pcl::mrf::FileError
void writeField(const pcl::mrf::DistanceField& field, const Eigen::Vector3d& offset, const std::string& path);

} // namespace mrf_apps

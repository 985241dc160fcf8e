// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Triangle meshes: what they are, what is measured of them, their colors, and files of them with all fields.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/report.h>

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pcl {

struct PolygonMesh;

namespace mrf {

using Triangle = std::array<std::int32_t, 3>;

/// An indexed triangle mesh in the recentered frame. Triangles are counter-clockwise seen from outside (d > 0).
/// Optional per-vertex arrays are either empty or as long as `vertices`.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Triangle> triangles;
  std::vector<Eigen::Vector3f> normals; ///< unit, outward: the normalized gradient of the field
  std::vector<float> confidences;       ///< α at the vertex, 0..1
  /// Standard deviation of the surface along its normal, cloud's unit; see UncertaintyOptions. Empty: not asked for.
  std::vector<float> sigmas;
  std::vector<std::uint8_t> calibrated; ///< 1, or 0 where sigma is an extrapolation; with sigmas only
};

/// Keeps the triangles whose flag is set and the vertices they use, in their order, with all per-vertex arrays.
/// \pre keep.size() == mesh.triangles.size()
PCL_MRF_EXPORT TriangleMesh select(const TriangleMesh& mesh, const std::vector<std::uint8_t>& keep);

/// The mesh with each vertex moved along its normal; all but the vertices stays as it is, the normals too.
/// \param distances one per vertex, cloud's unit \pre the mesh has normals
PCL_MRF_EXPORT TriangleMesh displaced(TriangleMesh mesh, const std::vector<float>& distances);

/// 2 · inradius / circumradius of a triangle: 1 for equilateral, 0 for degenerate.
PCL_MRF_EXPORT double triangleQuality(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);

/// Computes all statistics, of any mesh. Triangles with a repeated vertex or an index out of range count as degenerate
/// and are left out of the topology (edges, components, Euler characteristic); areas, volumes and lengths that are not
/// finite are left out of the sums. \throw ResourceLimit for more than 2³¹/3 triangles
PCL_MRF_EXPORT MeshStatistics measure(const TriangleMesh& mesh, Execution& execution);

/// The same on the calling thread.
PCL_MRF_EXPORT MeshStatistics measure(const TriangleMesh& mesh);

using Rgb = std::array<std::uint8_t, 3>;

/// The sigma that is shown red: the 95th percentile, in two digits. \param sigmas not empty
PCL_MRF_EXPORT float largestSigmaShown(std::vector<float> sigmas);

/// The color of a sigma: blue at 0, over green and yellow to red at `largest` and above.
PCL_MRF_EXPORT Rgb sigmaColor(float sigma, float largest);

/// The color of a confidence: blue at 0 to skin at 1, linear between.
PCL_MRF_EXPORT Rgb confidenceColor(float confidence);

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

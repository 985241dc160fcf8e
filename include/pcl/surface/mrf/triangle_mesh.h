// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Triangle meshes: data structure, statistics, colors, and files with all fields.
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

/// An indexed triangle mesh in the recentered frame. The vertices of a triangle are counter-clockwise seen from outside
/// (d > 0). Optional per-vertex arrays are either empty or as long as `vertices`.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Triangle> triangles;
  std::vector<Eigen::Vector3f> normals; ///< unit, outward: the normalized gradient of the field
  std::vector<float> confidences;       ///< α at the vertex, 0..1
  /// Standard deviation of the surface along its normal, cloud's unit; see UncertaintyOptions. Empty: not computed.
  std::vector<float> sigmas;
  std::vector<std::uint8_t> calibrated; ///< 1, or 0 where sigma is extrapolated; empty without sigmas
};

/// The triangles whose flag is set and the vertices that they use, in their order, with all per-vertex arrays.
/// \pre keep.size() == mesh.triangles.size()
PCL_MRF_EXPORT TriangleMesh select(const TriangleMesh& mesh, const std::vector<std::uint8_t>& keep);

/// The mesh with each vertex moved along its normal. The normals and all else stay as they are.
/// \param distances one per vertex, cloud's unit \pre the mesh has normals
PCL_MRF_EXPORT TriangleMesh displaced(TriangleMesh mesh, const std::vector<float>& distances);

/// 2 · inradius / circumradius of a triangle: 1 for equilateral, 0 for degenerate.
PCL_MRF_EXPORT double triangleQuality(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c);

/// Computes the statistics of any mesh. Triangles with a repeated vertex or an index out of range count as degenerate
/// and are left out of the topology (edges, components, Euler characteristic). Areas, volumes and lengths that are not
/// finite are left out of the sums. \throw ResourceLimit for more than 2³¹/3 triangles
PCL_MRF_EXPORT MeshStatistics measure(const TriangleMesh& mesh, Execution& execution);

/// The same on the calling thread.
PCL_MRF_EXPORT MeshStatistics measure(const TriangleMesh& mesh);

using Rgb = std::array<std::uint8_t, 3>;

/// The sigma that is shown red: the 95th percentile, rounded up to two digits. \param sigmas not empty
PCL_MRF_EXPORT float largestSigmaShown(std::vector<float> sigmas);

/// The color of a sigma: blue at 0, then green and yellow, red at `largest` and above.
PCL_MRF_EXPORT Rgb sigmaColor(float sigma, float largest);

/// The color of a confidence: blue at 0, skin at 1, linear in between.
PCL_MRF_EXPORT Rgb confidenceColor(float confidence);

/// Saves a mesh as binary PLY with all fields of its cloud: normal_x as nx, as is usual in PLY; rgb or rgba as red,
/// green and blue; others under their own names. pcl::io::loadPLYFile reads them back.
///
/// A regular file is first written under another name in the same folder, then renamed, so that it is never incomplete.
/// Other files, such as /dev/stdout, are written to directly.
/// \return 0, or −1 after a PCL_ERROR that names the file and the reason, as with PCL's own writers
PCL_MRF_EXPORT int savePLY(const std::string& path, const pcl::PolygonMesh& mesh);

/// The same as binary VTK (legacy): the normals become the normals of the point data, the colors its scalars, and each
/// other field an array of its own name.
PCL_MRF_EXPORT int saveVTK(const std::string& path, const pcl::PolygonMesh& mesh);

/// One value per vertex, in memory of the caller.
struct VertexField {
  /// One word: x, y, z, nx, ny, nz, red, green and blue have their usual meaning, any other name is a scalar.
  std::string name;
  const void* values = nullptr; ///< address of the first vertex's value
  std::size_t stride = 0;       ///< bytes from one vertex's value to the next one's
  std::uint8_t type = 0;        ///< type of the value, of pcl::PCLPointField, such as FLOAT32
};

/// A mesh in memory of the caller.
struct MeshView {
  std::size_t vertices = 0, polygons = 0;
  std::vector<VertexField> fields; ///< must include x, y and z
  /// Writes the vertex indices of a polygon to the second argument.
  std::function<void(std::size_t, std::vector<std::int32_t>&)> corners;
  bool inSinglePrecision = false; ///< true: doubles are written as floats
};

/// Writes a mesh as PLY. PLY has no 64-bit integers: they become doubles. After an error the file may be incomplete.
/// \throw FileError if the file cannot be written, the mesh lacks x, y or z, or a polygon has an invalid vertex
PCL_MRF_EXPORT void writePLY(const MeshView& mesh, const std::string& path);

/// The same as VTK.
PCL_MRF_EXPORT void writeVTK(const MeshView& mesh, const std::string& path);

} // namespace mrf
} // namespace pcl

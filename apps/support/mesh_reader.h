// SPDX-License-Identifier: BSD-3-Clause
/// Reads triangle meshes from files.
#pragma once

#include "surface_mesh.h"

#include <string>

namespace mrf_apps {

/// Reads the vertices and faces of a PLY, OBJ, OFF or STL file; the extension tells which.
///
/// Nothing is repaired: repeated vertices of faces, unused and coincident vertices stay as they are. Faces with more
/// than three corners become fans of triangles around their first corner, which is right for convex ones. STL files
/// have no vertices: corners with equal coordinates become one vertex. Normals are read if every vertex has one, and so
/// are the scalars of PLY files.
/// \throw UsageError if the extension is none of these
/// \throw FileError if the file is missing, unreadable, empty, truncated, not what its extension says, without faces,
/// or has faces with vertices that are not there
SurfaceMesh readMesh(const std::string& path);

/// The same for the bytes of a file. \param type extension that readMesh knows, lower case \param path for messages
SurfaceMesh parseMesh(const std::string& type, const std::string& path, const std::string& text);

/// The mesh with vertices of equal coordinates merged, in the order of their first ones; positions and triangles only.
/// For files that give every triangle its own corners.
SurfaceMesh mergeVertices(const SurfaceMesh& mesh);

/// Why readMesh cannot read a file of this name, worded to follow the name in a message, with the command that converts
/// it if there is one. Empty if readMesh knows the extension.
std::string whyNotReadable(const std::string& path);

/// What a file holds, judged by its first bytes, or for OBJ by its first face. \return other if there is no such file
enum class Content { other, points, mesh };
Content contentOf(const std::string& path);

/// Protects an input that stands in the place of OUTPUT, as the last file of scans/*.ply does if OUTPUT is forgotten.
/// \throw UsageError if the output exists and holds what this tool reads rather than writes
void refuseToReplace(Content content, const std::string& output);

/// Extensions that readMesh knows, for messages.
extern const std::string meshInputExtensions;

} // namespace mrf_apps

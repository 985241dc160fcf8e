// SPDX-License-Identifier: BSD-3-Clause
/// Triangle meshes out of files.
#pragma once

#include "surface_mesh.h"

#include <string>

namespace mrf_apps {

/// Reads the vertices and faces of a PLY, OBJ, OFF or STL file; chosen by the extension.
///
/// Nothing is repaired: repeated vertices of faces, unused and coincident vertices stay as they are. Faces with more
/// than three corners become fans of triangles around their first corner, which is right for convex ones. The corners
/// of an STL file, which has no vertices, are one vertex where their coordinates are equal. Of the fields of vertices
/// normals, one for each, and PLY's scalars are read.
/// \throw UsageError if the extension is none of these
/// \throw FileError if the file is missing, unreadable, empty, truncated, not what its extension says, without faces,
/// or
///        has faces with vertices that are not there
SurfaceMesh readMesh(const std::string& path);

/// The same for the bytes of a file. \param type extension that readMesh knows, lower case \param path for messages
SurfaceMesh parseMesh(const std::string& type, const std::string& path, const std::string& text);

/// The mesh with one vertex for all of equal coordinates, numbered by the first of them; positions and triangles only.
/// For files that give every triangle its own corners.
SurfaceMesh mergeVertices(const SurfaceMesh& mesh);

/// What is wrong with the name of a mesh file, to be put behind it, with the command that converts it if there is one;
/// empty: readMesh knows its extension.
std::string whyNotReadable(const std::string& path);

/// What a file holds, by the bytes it begins with, or of OBJ by its first face. \return other if it is not there
enum class Content { other, points, mesh };
Content contentOf(const std::string& path);

/// Of two files without an OUTPUT, as of scans/*.ply, the second one is not to be lost.
/// \throw UsageError if the output is there and holds what this tool reads rather than writes
void refuseToReplace(Content content, const std::string& output);

/// Extensions that readMesh knows, for messages.
extern const char* const meshInputExtensions;

} // namespace mrf_apps

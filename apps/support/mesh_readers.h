// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The readers behind readMesh, one per file format that only meshes have.
#pragma once

#include "point_readers.h"
#include "surface_mesh.h"

#include <string>

namespace mrf_apps {

// Each is given the path, for its messages, and the whole file, which is not empty. All throw FileError, and none takes
// more memory than a small multiple of what the file holds (once unpacked), whatever its header promises.

/// Text or binary; equal corners become one vertex. Our own header of a shifted file shifts it back (stlOffset).
SurfaceMesh parseStl(const std::string& path, const std::string& text);

/// Legacy VTK files of version 1 to 5 with a data set POLYDATA, text or binary: polygons and triangle strips.
SurfaceMesh parseVtk(const std::string& path, const std::string& text);

/// VTK's XML files of type PolyData in every encoding, compressed or not: polygons and triangle strips.
SurfaceMesh parseVtp(const std::string& path, const std::string& text);

/// Appends polygons as fans around their first corners. \throw FileError if a corner is no vertex of the mesh
void addPolygons(const std::string& path, const Polygons& polygons, SurfaceMesh& mesh);

/// Appends triangle strips, every second triangle turned, so that all face alike. \throw FileError as addPolygons
void addStrips(const std::string& path, const Polygons& strips, SurfaceMesh& mesh);

} // namespace mrf_apps

/// \file
/// \brief The readers behind readPoints, one per file format.
#pragma once

#include "point_table.h"

#include <pcl/Vertices.h>

#include <string>

namespace mrf_apps {

// Each is given the path, for its messages and for PCL's readers, and the whole file, which is not empty.
// All throw FileError.

/// Columns x y z [nx ny nz | r g b] [more], or x y z intensity. Lines that start with # or // are comments; one leading
/// line may hold the number of points, one the names of the columns.
PointTable parseXyz(const std::string& path, const std::string& text);

/// Vertices of a Wavefront OBJ file. Normals follow the indices of the faces and are averaged per vertex.
/// Not PCL's reader: that one pairs vertices and normals by their order in the file.
/// \param faces receives the faces, if not null
PointTable parseObj(const std::string& path, const std::string& text, std::vector<pcl::Vertices>* faces = nullptr);

/// Points of a PCD file through pcl::PCDReader, which crashes on files without a header and takes
/// lines of too few numbers for points; both are refused beforehand.
PointTable readPcd(const std::string& path, const std::string& text);

/// Vertices of a PLY file, text or binary, with all scalar properties. \param faces receives the faces, if not null
PointTable readPly(const std::string& path, const std::string& text, std::vector<pcl::Vertices>* faces = nullptr);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Points into files.
#pragma once

#include "point_table.h"

#include <string>

namespace mrf_apps {

/// True if writePoints knows the extension (lower case, without the dot).
bool isWritableCloud(const std::string& extension);

/// Extensions that writePoints knows, for messages.
extern const char* const pointOutputExtensions;

/// Writes positions and, if there are any, normals as binary PLY or PCD. Positions are floats, or doubles where float
/// does not hold them (floatOffset). The same bytes everywhere, which PCL's and VTK's writers do not promise.
/// \param format extension, lower case, without the dot
/// \throw pcl::mrf::FileError
void writePoints(const PointTable& points, const std::string& path, const std::string& format);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Borders of a mesh that touch come apart before it is remeshed.
#pragma once

#include "remesher/remeshed_surface.h"

namespace pcl {
namespace mrf {

/// Vertices of different parts of the border at one place, where trimming left two fans that touch: each moves a little
/// into its own, as far as its triangles allow.
void partBorders(RemeshedSurface& surface);

} // namespace mrf
} // namespace pcl

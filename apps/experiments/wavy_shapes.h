// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Generated objects with structure: what is smooth all over says little about how a method goes on in a hole.
#pragma once

#include "support/surface_mesh.h"

#include <pcl/surface/mrf/execution.h>

namespace mrf_apps {

/// Of the waves, beside shapes of a length of 3 and 2.
constexpr double waveHeight = .06;

/// A torus with radii of 1 and .42, and a box of 2 × 1.5 × 1 with edges rounded by .2, whose surface goes up and down
/// in waves: closed, smooth, of some 100,000 triangles. The waves are about as long as holes of 10 % of the diagonal
/// are wide, so that the rim of a hole tells something about what is missing, but not all.
SurfaceMesh wavyTorus(pcl::mrf::Execution& execution);
SurfaceMesh wavyBox(pcl::mrf::Execution& execution);

} // namespace mrf_apps

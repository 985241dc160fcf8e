// SPDX-License-Identifier: BSD-3-Clause
/// Trimming by error instead of size: drops surface that may be too far off.
#pragma once

#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

namespace pcl::mrf {

/// Drops the triangles with a vertex whose sigma exceeds the limit, then those without a vertex all of whose triangles
/// are left. The second step (an opening by one ring) drops threads, fringes and single triangles.
/// \param mesh with sigmas and confidences; stays manifold: fans that share only a vertex are separated
/// Cost: linear, serial.
ErrorLimitSummary limitSigma(TriangleMesh& mesh, float maxSigma);

} // namespace pcl::mrf

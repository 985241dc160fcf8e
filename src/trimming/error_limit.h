// SPDX-License-Identifier: BSD-3-Clause
/// Trimming by error instead of size: surface that may be too far off goes.
#pragma once

#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

namespace pcl::mrf {

/// Drops the triangles with a vertex whose sigma exceeds the limit. Of the others those stay that touch a vertex all of
/// whose triangles are left: no threads, fringes or single triangles (an opening by one ring).
/// \param mesh with sigmas and confidences; stays manifold: what would hang together at corners only is parted
/// Cost: linear, serial.
ErrorLimitSummary limitSigma(TriangleMesh& mesh, float maxSigma);

} // namespace pcl::mrf

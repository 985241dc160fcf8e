// SPDX-License-Identifier: BSD-3-Clause
/// Support-aware trimming: which invented surface is kept (ours; the paper keeps all).
#pragma once

#include "mesh/vertex_fields.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <optional>

namespace pcl::mrf {

/// Option maxHole; if it is 0, half of the diagonal. \see trim
float resolvedMaxHole(const TrimmingOptions& options, float diagonal);

/// Option maxGap; if it is 0, maxHole; if that is 0 too, 24 % of the diagonal, as an upper limit.
float resolvedMaxGap(const TrimmingOptions& options, float diagonal);

struct TrimResult : TrimSummary {
  TriangleMesh mesh;                        ///< all per-vertex arrays follow
  std::optional<MeshStatistics> statistics; ///< of the mesh, if they were measured anyway

  const TrimSummary& summary() const { return *this; }
};

/// Drops surface that no data support: what fills no hole, and components of few or contradicted points. See
/// src/method.md, "Trimming". Triangles with a repeated vertex or an index out of range are dropped as well, unless the
/// options ask for no trimming.
/// \param mesh with confidences; stays manifold: a vertex is duplicated where triangles touch only there
/// \param points with normals; without spacings only limits and rims decide; without sensors no line of sight is
/// tested, and one direction of view is estimated from the normals, if they allow for it \param search holds
/// points.positions \param diagonal of the points' box, or of the largest piece's if they lie in pieces far apart: for
/// automatic limits \throw std::invalid_argument if the mesh has no confidences and the options ask for trimming Cost:
/// linear in the number of triangles, one query per vertex of the tested regions, and n log n for the n vertices of
/// extrapolation that are closer than maxGap. The result does not depend on the number of threads.
TrimResult trim(TriangleMesh mesh, const OrientedPoints& points, const NeighborSearch& search, float diagonal,
                const TrimmingOptions& options, Execution& execution);

/// Cuts the mesh where the points end: a little outside of the last ones. Trimming leaves all that points
/// support, which is some two spacings more, and cuts along edges. Fillings with points to both sides stay, others at
/// the border go. No triangle moves, so none comes to intersect another. \param mesh with confidences; the arrays of a
/// vertex are interpolated on an edge that is cut, without sigmas \return the number of triangles that were dropped or
/// cut Cost: linear, and a query for each vertex beyond the points and of fillings at the border.
std::int64_t tightenBorders(TriangleMesh& mesh, const Support& support, Execution& execution);

/// Drops the triangles with a vertex whose sigma exceeds the limit, then those without a vertex all of whose triangles
/// are left: threads, fringes and single triangles. \param mesh with sigmas and confidences; stays manifold
/// Cost: linear, serial.
ErrorLimitSummary limitSigma(TriangleMesh& mesh, float maxSigma);

} // namespace pcl::mrf

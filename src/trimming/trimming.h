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

/// The option, or half of that diagonal, see trim.
float resolvedMaxHole(const TrimmingOptions& options, float diagonal);

/// The option, or maxHole, or 24 % of that diagonal: the upper limit.
float resolvedMaxGap(const TrimmingOptions& options, float diagonal);

struct TrimResult : TrimSummary {
  TriangleMesh mesh;                        ///< all per-vertex arrays follow
  std::optional<MeshStatistics> statistics; ///< of the mesh, if they had to be measured to see that all is kept

  const TrimSummary& summary() const { return *this; }
};

/// Drops surface that no data support.
///
/// A triangle is unsupported if the confidence of all its vertices is 0. A region of such triangles stays if it fills a
/// hole within the limits, or a morphological closing of the supported surface covers it. Of what is left components go
/// that no coherent points stand behind (see src/method.md). Triangles with a repeated vertex or an index out of range
/// are dropped, unless the options ask for no trimming.
/// \param mesh with confidences; remains manifold: vertices that touch only at a corner after trimming are duplicated
/// \param points with normals; without spacings all gaps are closed alike, and without sensors all but steps in depth
/// \param search holds points.positions \param diagonal for the automatic limits: of the points'
/// bounding box or, where they lie in pieces far apart, of the largest piece's
/// \throw std::invalid_argument if the mesh has no confidences and the options ask for trimming
/// Cost: linear in the number of triangles, one query per vertex of the regions in question, and n log n for the n
/// vertices of extrapolation that are closer than maxGap. The result does not depend on the number of threads.
TrimResult trim(TriangleMesh mesh, const OrientedPoints& points, const NeighborSearch& search, float diagonal,
                const TrimmingOptions& options, Execution& execution);

/// Pulls the vertices of borders that no point supports back to where support ends: trimming cuts along edges, up to an
/// edge beyond it. A vertex moves along the edge on which support ends soonest, less far where a triangle around it
/// would turn over, and not at all where triangles at borders would intersect; where a border runs through fillings it
/// stays.
/// \return how many vertices moved; their normals and confidences are those of before
/// Cost: linear, and some queries per vertex of a border.
std::int64_t tightenBorders(TriangleMesh& mesh, const Support& support, Execution& execution);

} // namespace pcl::mrf

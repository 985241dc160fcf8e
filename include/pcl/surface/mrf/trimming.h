// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Support-aware trimming: which invented surface is kept (ours; the paper keeps all).
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/mesh_quality.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>
#include <pcl/surface/mrf/vertex_fields.h>

#include <cstdint>
#include <optional>

namespace pcl {
namespace mrf {

enum class Trimming {
  none,     ///< keep all: watertight inside the volume
  holes,    ///< keep hole fillings up to a size, drop extrapolation and components without support
  supported ///< keep only surface that data support
};

struct TrimmingOptions {
  Trimming kind = Trimming::holes;
  float maxHole = 0; ///< largest hole diameter that is kept filled, cloud's unit; 0 = half the diagonal, see trim
  /// Largest width of what is filled of an open surface, cloud's unit: of holes, also those that are joined to the
  /// outside, and of bays. 0 = maxHole if that is given, else 24 % of the diagonal, but 28 local spacings of the points
  /// where the filling would turn away from the surface around it, as it does behind a step in depth: the mean cosine
  /// of its normals to those of the nearest points is below .6; where it is hidden from all sensors behind other
  /// points: that is a shadow, no hole; where the only sensor saw other points through it; and where it is edge-on for
  /// all sensors, or turned away: the mean cosine of its normals to the best line of sight is below .17, and so is that
  /// of the part in question. Without sensors that goes by the direction from which a single one must have seen all
  /// points, if normals allow for one. Where filling closes a surface, maxHole alone decides.
  float maxGap = 0;
  /// Components with fewer coherent points behind them are dropped, the largest one excepted, 0..1000000; 0 or 1: none
  /// are. Three are enough where no other surface is as close as they are to each other. Not with `none`. Measured with
  /// 5 % of outliers in 40 scans: bubbles stood around up to 24 points, of which two at most were coherent; patches of
  /// three and four points of a range scan were.
  int minComponentPoints = 12;
  /// Components with less than this share of the supported area are dropped as well, [0, 1). The paper drops those with
  /// less than 1 % of the points (Sec. 3.1), and with them small objects beside large ones and what a hole cuts off a
  /// limb. Not with `none`.
  float minComponentShare = 0;
};

/// \throw InvalidOption naming the first field that is out of range
PCL_MRF_EXPORT void validate(const TrimmingOptions& options);

/// The option, or half of that diagonal, see trim.
PCL_MRF_EXPORT float resolvedMaxHole(const TrimmingOptions& options, float diagonal);

/// The option, or maxHole, or 24 % of that diagonal: the upper limit.
PCL_MRF_EXPORT float resolvedMaxGap(const TrimmingOptions& options, float diagonal);

struct TrimSummary {
  std::int64_t holesFilled = 0;           ///< unsupported pieces that were kept, bays of the rim among them
  std::int64_t extrapolationsDropped = 0; ///< unsupported pieces that were dropped
  std::int64_t componentsDropped = 0;
  double areaFilled = 0, areaDropped = 0; ///< cloud's unit squared
  double largestHole = 0;                 ///< diameter of the largest piece that was kept, cloud's unit
};

/// What UncertaintyOptions::maxError dropped; areas in the cloud's unit squared.
struct ErrorLimitSummary {
  std::int64_t triangles = 0;
  double area = 0;
  double measuredArea = 0; ///< of it, that of triangles with support
};

struct TrimResult : TrimSummary {
  TriangleMesh mesh;                        ///< all per-vertex arrays follow
  std::optional<MeshStatistics> statistics; ///< of the mesh, if they had to be measured to see that all is kept

  const TrimSummary& summary() const { return *this; }
};

/// Drops surface that no data support.
///
/// A triangle is unsupported if the confidence of all its vertices is 0. Edge-connected unsupported triangles form a
/// region. It fills a hole if it is bounded all around by supported surface and its diameter, estimated as twice the
/// largest distance from one of its vertices to the nearest data point, does not exceed the limit: maxHole if the
/// surface is closed with its holes filled, and at most a third of it would be filling; maxGap if it stays open.
///
/// The rest is extrapolation, but for what a morphological closing keeps of it: the surface is dilated by maxGap / 2
/// along the mesh, counted from the data points, and eroded by as much. So a hole near the rim of an open scan is
/// filled although a neck joins it to the outside, and the sheet around the scan is not kept. Triangles with a repeated
/// vertex or an index out of range are dropped, unless the options ask for no trimming.
///
/// What is left falls into components. A point is behind a component if it is the nearest one of a vertex with support,
/// and no other component is closer to it; it is coherent if at least a third of those of its eight nearest points that
/// are behind that component, too, and two at least have normals within 40° of its own. Bubbles around outliers have no
/// such points, whatever their area and however many outliers they hold; real patches consist of them, however small.
/// \param mesh with confidences; remains manifold: vertices that touch only at a corner after trimming are duplicated
/// \param points with normals; without spacings all gaps are closed alike, and without sensors all but steps in depth
/// \param search holds points.positions \param diagonal for the automatic limits: of the points'
/// bounding box or, where they lie in pieces far apart, of the largest piece's
/// \throw std::invalid_argument if the mesh has no confidences and the options ask for trimming
/// Cost: linear in the number of triangles, one query per vertex of the regions in question, and n log n for the n
/// vertices of extrapolation that are closer than maxGap. The result does not depend on the number of threads.
PCL_MRF_EXPORT TrimResult trim(TriangleMesh mesh, const OrientedPoints& points, const NeighborSearch& search,
                               float diagonal, const TrimmingOptions& options, Execution& execution);

/// Pulls the vertices of borders that no point supports back to where support ends: trimming cuts along edges, up to an
/// edge beyond it. A vertex moves along the edge on which support ends soonest, less far where a triangle around it
/// would turn over, and not at all where triangles at borders would intersect; where a border runs through fillings it
/// stays.
/// \return how many vertices moved; their normals and confidences are those of before
/// Cost: linear, and some queries per vertex of a border.
PCL_MRF_EXPORT std::int64_t tightenBorders(TriangleMesh& mesh, const Support& support, Execution& execution);

} // namespace mrf
} // namespace pcl

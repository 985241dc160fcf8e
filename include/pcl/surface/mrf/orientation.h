/// \file
/// \brief Connected components of a point set and consistent orientation of its normals (paper Sec. 3.1).
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbour_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/sampling_density.h>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

struct OrientationOptions {
  float neighbourDistance = 0;    ///< two points are neighbours if closer, cloud's unit; 0 = max(l̄ + 6 σ_l, 2.5 l̄)
  float maxAngle = 15;            ///< and their normals within this angle, degrees, (0, 90]
  bool joinAcrossCreases = true;  ///< join components over edges that fail the angle, most parallel first
  float minComponentShare = .01f; ///< drop components with a smaller share of the points, [0, 1)
  float lowAgreement = .75f;      ///< report a warning below this agreement, [0, 1]
};

/// \throw InvalidOption naming the first field that is out of range
void validate(const OrientationOptions& options);

/// How the sign of a component was decided.
struct OrientationResult {
  std::vector<Eigen::Vector3f> normals; ///< consistently oriented, unit; one per point
  std::vector<std::uint8_t> keep;       ///< 0 for points of small components
  std::int64_t components = 0;          ///< after joining, before dropping
  std::int64_t componentsAtCreases = 0; ///< as the angle criterion alone cuts them
  std::int64_t componentsDropped = 0;
  std::int64_t componentsFlipped = 0; ///< by the vote of sensors, reference normals or signed volume
  std::int64_t pointsDropped = 0;
  std::int64_t pointsFlipped = 0; ///< normals whose sign differs from the one they came with
  double agreement = 1;           ///< share of kept points whose normal agrees with their vote; 1 without a vote
};

/// Which votes decide the sign of a component.
enum class OrientationVote {
  none,      ///< keep the normals' signs as they are; only the components are computed
  reference, ///< the majority of dot(normal, reference normal)
  sensor,    ///< the majority of dot(normal, sensor - position); without views a point's sensor is the nearest one
  outward    ///< positive signed volume, Σ (p - centroid)·n > 0
};

/// Makes normals consistent inside each connected component and decides the sign of each component by a vote.
///
/// Edges join points closer than the neighbour distance. They are taken in the order of how well the two normals agree
/// up to sign (after reflection at the edge's bisector plane, which is exact on circular arcs); the component's tree
/// fixes the relative signs. Creases stop the paper's search for good; here they only come last.
/// \param normals unit length, one per point, as estimated or as they came; a zero normal joins nothing and is dropped
/// \param vote OrientationVote::sensor needs points.sensors, reference needs points.normals
/// The result does not depend on the number of threads or, up to ties, on the order of the points.
OrientationResult orientNormals(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                const NeighbourSearch& search, const SamplingDensity& density, OrientationVote vote,
                                const OrientationOptions& options, Execution& execution);

} // namespace mrf
} // namespace pcl

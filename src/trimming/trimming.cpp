// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/trimming.h"

#include "mesh/mesh_topology.h"
#include "options/validation.h"
#include "points/sensor_view.h"
#include "trimming/closing.h"
#include "trimming/lines_of_sight.h"
#include "trimming/mesh_components.h"
#include "trimming/viewpoints.h"

#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace pcl::mrf {
namespace {

/// Max share of a component's area in fillings; with more, they are the back of what was seen from one side.
constexpr double maxFilled = 1. / 3;

/// Max distance of a filling from the middle of its rim, relative to that of the rim. A filling of up to half a ball
/// reaches no farther than its rim; what exceeds this factor is the bulb behind the end of a tube.
constexpr float maxOutgrowth = 1.3f;

/// Distances from the points, in local spacings. The triangles of a filling beyond judgedFrom form connected parts; a
/// part that gets beyond judgedIfBeyond is judged by itself, a narrower one is kept. After lines of sight have cut the
/// fillings, all parts beyond judgedFromWhereCut are judged, however narrow they are.
constexpr float judgedFrom = 6, judgedIfBeyond = 14, judgedFromWhereCut = 4;

/// Min mean cosine between the normals of a part and those of the surface around it. A part with less fills no hole of
/// that surface: it bridges a step in depth, which a sensor could not see behind, or is a balloon.
constexpr double minContinuation = .6;

/// Min mean cosine between the normals of a part and the line of sight. A part with less could be seen by no sensor: it
/// goes on where the surface turned out of sight, as between a leg and a tail. Its triangles that face a sensor stay.
constexpr double minFacing = .17;

constexpr float unknown = -1, asked = -2; ///< squared distances of vertices before and during a search

/// Max widths of fillings, cloud's unit.
struct FillingLimits {
  double hole; ///< if filling closes the surface
  double gap;  ///< if it stays open
  /// True: fillings are kept even if they outgrow their rim, turn away from the surface around, or sensors saw through
  /// them. False: the first are dropped; the others, if points have spacings, only where they are wide in those.
  bool closesBridges;
};

/// The nearest data point of each vertex that was asked for, searched once.
class NearestPoints {
public:
  NearestPoints(const TriangleMesh& mesh, const NeighborSearch& search, Execution& execution)
      : mesh_(mesh), search_(search), execution_(execution)
  {}

  /// Searches for those that are not known yet.
  void find(const std::vector<std::int32_t>& vertices)
  {
    if (squared_.empty()) {
      squared_.resize(mesh_.vertices.size(), unknown);
      points_.resize(mesh_.vertices.size(), 0);
    }
    std::vector<std::int32_t> missing;
    for (const std::int32_t v : vertices)
      if (squared_[v] == unknown) {
        squared_[v] = asked;
        missing.push_back(v);
      }
    execution_.forRange(missing.size(), 1024, [&](std::size_t begin, std::size_t end) {
      Neighbors nearest;
      for (std::size_t n = begin; n < end; ++n) {
        const std::size_t v = missing[n];
        const bool isFound = search_.nearest(mesh_.vertices[v], 1, nearest) > 0;
        squared_[v] = isFound ? nearest.squaredDistances.front() : 0;
        points_[v] = isFound ? nearest.indices.front() : 0;
      }
    });
  }

  /// \pre the vertex was searched for, and there are points
  std::size_t point(std::int32_t vertex) const { return points_[vertex]; }
  float squaredDistance(std::int32_t vertex) const { return squared_[vertex]; }

private:
  const TriangleMesh& mesh_;
  const NeighborSearch& search_;
  Execution& execution_;
  std::vector<float> squared_; ///< by vertex; empty until the first search
  std::vector<std::int32_t> points_;
};

/// Flags of the corners of the flagged triangles.
std::vector<std::uint8_t> flagCorners(const TriangleMesh& mesh, const std::vector<std::uint8_t>& isFlagged)
{
  std::vector<std::uint8_t> flags(mesh.vertices.size(), 0);
  for (std::size_t t = 0; t < isFlagged.size(); ++t)
    if (isFlagged[t])
      for (const std::int32_t v : mesh.triangles[t])
        flags[v] = 1;
  return flags;
}

/// Tells fillings of holes from extrapolation. Flags are one per triangle of the mesh.
class HoleFinder {
public:
  /// \param supported flags of triangles that data support \pre the arguments outlive this
  HoleFinder(const TriangleMesh& mesh, const std::vector<std::uint8_t>& supported, const OrientedPoints& points,
             const NeighborSearch& search, Execution& execution)
      : mesh_(mesh), supported_(supported), points_(points), execution_(execution), nearest_(mesh, search, execution)
  {
    for (std::size_t t = 0; t < supported.size(); ++t)
      if (!supported[t] && hasValidIndices(mesh, t))
        unsupported_.push_back(static_cast<std::int32_t>(t));
  }

  /// Flags of the supported triangles and of those that fill a hole or a gap.
  std::vector<std::uint8_t> keepFillings(const FillingLimits& limits)
  {
    std::vector<std::uint8_t> keep(supported_);
    if (unsupported_.empty())
      return keep;
    findRegions();
    if (!limits.closesBridges)
      compareWithRims();
    findOpenRegions(limits.hole);
    for (const std::int32_t t : unsupported_) {
      const std::size_t r = regionOf_[t];
      keep[t] = regions_[r].fits(isOpen_[r] ? std::min(limits.gap, limits.hole) : limits.hole) ? 1 : 0;
    }
    keepGaps(limits.gap, keep);
    if (limits.closesBridges || points_.spacings.empty())
      return keep;
    std::vector<std::int32_t> firstCorners;
    for (const std::int32_t t : fillings(keep))
      firstCorners.push_back(mesh_.triangles[t][0]);
    nearest_.find(firstCorners);
    dropDoubtful(judgedFrom, judgedIfBeyond, keep); // before lines of sight divide them
    if (!points_.sensors.empty()) {
      dropSeenThrough(keep);
      dropDoubtful(judgedFromWhereCut, 0, keep);
    }
    return keep;
  }

  /// Counts and measures what became of the unsupported triangles.
  void describe(const std::vector<std::uint8_t>& keep, TrimResult& result)
  {
    if (unsupported_.empty())
      return;
    std::vector<std::int32_t> kept, dropped, regionOf;
    for (const std::int32_t t : unsupported_)
      (keep[t] ? kept : dropped).push_back(t);
    result.extrapolationsDropped = group(dropped, regionOf);
    std::vector<Region> fillings(group(kept, regionOf));
    for (const std::int32_t t : kept)
      fillings[regionOf[t]].area += area(t);
    measureReach(regionOf, false, fillings);
    result.holesFilled = static_cast<std::int64_t>(fillings.size());
    for (const Region& filling : fillings) {
      result.areaFilled += filling.area;
      result.largestHole = std::max(result.largestHole, filling.diameter());
    }
  }

private:
  /// An edge-connected set of unsupported triangles.
  struct Region {
    bool touchesBoundary = false;
    bool hasSupportedNeighbor = false;
    double area = 0;
    float squaredReach = 0; ///< largest squared distance of a vertex to the nearest data point
    bool outgrowsRim = false;

    bool isBounded() const { return hasSupportedNeighbor && !touchesBoundary; }
    double diameter() const { return 2 * std::sqrt(static_cast<double>(squaredReach)); }
    bool fits(double limit) const { return isBounded() && !outgrowsRim && diameter() <= limit; }
  };

  /// Numbers the edge-connected sets of these triangles. \param groupOf negative for all others \return their number
  std::int32_t group(const std::vector<std::int32_t>& triangles, std::vector<std::int32_t>& groupOf) const
  {
    std::vector<std::uint8_t> isMember(mesh_.triangles.size(), 0);
    for (const std::int32_t t : triangles)
      isMember[t] = 1;
    bool isTorn;
    return groupTriangles(mesh_, isMember, execution_, groupOf, isTorn);
  }

  /// Measures the reach of all regions, or of the bounded ones.
  void measureReach(const std::vector<std::int32_t>& regionOf, bool onlyBounded, std::vector<Region>& regions)
  {
    const auto forCorners = [&](const auto& body) {
      for (const std::int32_t t : unsupported_)
        if (regionOf[t] >= 0 && (!onlyBounded || regions[regionOf[t]].isBounded()))
          for (const std::int32_t v : mesh_.triangles[t])
            body(v, regions[regionOf[t]]);
    };
    std::vector<std::int32_t> vertices;
    forCorners([&](std::int32_t v, const Region&) { vertices.push_back(v); });
    nearest_.find(vertices);
    forCorners([&](std::int32_t v, Region& region) {
      region.squaredReach = std::max(region.squaredReach, nearest_.squaredDistance(v));
    });
  }

  void findRegions()
  {
    regions_.assign(group(unsupported_, regionOf_), {});
    isOnBoundary_.assign(mesh_.vertices.size(), 0);

    // Flags all triangles with a corner in a region, as they share the region's edges.
    std::vector<std::uint8_t> isNear(mesh_.vertices.size(), 0), isMember(mesh_.triangles.size());
    std::vector<std::int32_t> vertices;
    for (const std::int32_t t : unsupported_)
      for (const std::int32_t v : mesh_.triangles[t])
        if (!isNear[v]) {
          isNear[v] = 1;
          vertices.push_back(v);
        }
    forTriangles(mesh_, execution_, [&](std::size_t t) {
      const Triangle& corners = mesh_.triangles[t];
      isMember[t] = hasValidIndices(mesh_, t) && (isNear[corners[0]] || isNear[corners[1]] || isNear[corners[2]]);
    });
    const VertexCorners corners = groupCorners(mesh_, isMember);
    Ring ring;
    for (const std::int32_t v : vertices) {
      ring.set(mesh_, corners, v);
      ring.findEdges();
      for (const Ring::Edge& edge : ring.edges()) {
        const auto triangleOf = [&](const Ring::Side& side) { return ring.corner(side.at) / 3; };
        const auto isSupported = [&](const Ring::Side& side) { return supported_[triangleOf(side)] != 0; };
        const bool anySupported = std::any_of(edge.begin, edge.end, isSupported);
        for (const Ring::Side* side = edge.begin; side < edge.end; ++side) {
          if (isSupported(*side))
            continue;
          Region& region = regions_[regionOf_[triangleOf(*side)]];
          region.touchesBoundary = region.touchesBoundary || edge.sides() == 1;
          if (edge.sides() == 1)
            isOnBoundary_[v] = 1;
          region.hasSupportedNeighbor = region.hasSupportedNeighbor || anySupported;
        }
      }
    }
    measureReach(regionOf_, true, regions_);
  }

  /// Finds the bounded regions that outgrow their rims.
  void compareWithRims()
  {
    const std::vector<std::uint8_t> isSupported = flagCorners(mesh_, supported_);
    struct Extent {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      double count = 0;
      float ofRim = 0, ofRest = 0; ///< largest squared distances from the rim's middle
    };
    std::vector<Extent> extents(regions_.size());
    const auto forCorners = [&](const auto& body) {
      for (const std::int32_t t : unsupported_)
        if (regions_[regionOf_[t]].isBounded())
          for (const std::int32_t v : mesh_.triangles[t])
            body(isSupported[v] != 0, mesh_.vertices[v], extents[regionOf_[t]]);
    };
    forCorners([](bool isOnRim, const Eigen::Vector3f& position, Extent& extent) {
      if (isOnRim) {
        extent.sum += position.cast<double>();
        ++extent.count;
      }
    });
    forCorners([](bool isOnRim, const Eigen::Vector3f& position, Extent& extent) {
      float& farthest = isOnRim ? extent.ofRim : extent.ofRest;
      farthest = std::max(farthest, (position - (extent.sum / extent.count).cast<float>()).squaredNorm());
    });
    for (std::size_t r = 0; r < regions_.size(); ++r)
      regions_[r].outgrowsRim = extents[r].ofRest > maxOutgrowth * maxOutgrowth * extents[r].ofRim;
  }

  /// Finds the regions whose component stays open even if all of its holes are filled, or would get fillings of more
  /// than maxFilled of its area.
  void findOpenRegions(double maxHole)
  {
    std::vector<std::int32_t> componentOf;
    bool isTorn;
    const std::size_t components = groupTriangles(mesh_, {}, execution_, componentOf, isTorn);
    std::vector<std::uint8_t> isOpenComponent(components, 0);
    std::vector<double> wholeArea(components, 0), unsupportedArea(components, 0);
    for (std::size_t t = 0; t < componentOf.size(); ++t)
      if (componentOf[t] >= 0)
        wholeArea[componentOf[t]] += area(t);
    for (const std::int32_t t : unsupported_) {
      unsupportedArea[componentOf[t]] += area(t);
      if (!regions_[regionOf_[t]].fits(maxHole))
        isOpenComponent[componentOf[t]] = 1;
    }
    for (std::size_t c = 0; c < components; ++c)
      if (unsupportedArea[c] > maxFilled * wholeArea[c])
        isOpenComponent[c] = 1;
    isOpen_.assign(regions_.size(), 0);
    for (const std::int32_t t : unsupported_)
      isOpen_[regionOf_[t]] = isOpenComponent[componentOf[t]];
  }

  /// Keeps those of the other triangles that a morphological closing fills.
  void keepGaps(double gap, std::vector<std::uint8_t>& keep)
  {
    std::vector<std::uint8_t> isSheet(mesh_.triangles.size(), 0);
    std::vector<std::int32_t> sheet;
    for (const std::int32_t t : unsupported_)
      if (!keep[t]) {
        isSheet[t] = 1;
        sheet.push_back(t);
      }
    if (sheet.empty())
      return;
    std::vector<std::uint8_t> isRim = flagCorners(mesh_, keep);
    std::vector<std::int32_t> ofRim;
    for (const std::int32_t t : sheet)
      for (const std::int32_t v : mesh_.triangles[t])
        if (isRim[v] == 1) {
          isRim[v] = 2; // once
          ofRim.push_back(v);
        }
    // With their distances from the data: a hole is as wide as the data are apart; support reaches farther.
    nearest_.find(ofRim);
    std::vector<RimVertex> described;
    for (const std::int32_t v : ofRim)
      described.push_back({v, std::sqrt(nearest_.squaredDistance(v))});
    const std::vector<std::uint8_t> isFilled =
        close(mesh_, groupCorners(mesh_, isSheet), described, static_cast<float>(gap / 2), isOnBoundary_);
    const auto isInside = [&](std::int32_t v) { return isRim[v] || isFilled[v]; };
    for (const std::int32_t t : sheet) {
      const Triangle& corners = mesh_.triangles[t];
      keep[t] = isInside(corners[0]) && isInside(corners[1]) && isInside(corners[2]) ? 1 : 0;
    }
  }

  /// The unsupported triangles that are kept.
  std::vector<std::int32_t> fillings(const std::vector<std::uint8_t>& keep) const
  {
    std::vector<std::int32_t> kept;
    for (const std::int32_t t : unsupported_)
      if (keep[t])
        kept.push_back(t);
    return kept;
  }

  /// True if the triangle's first vertex is farther from the points than some local spacings. \pre it was searched for
  bool isBeyond(std::int32_t triangle, float spacings) const
  {
    const std::int32_t first = mesh_.triangles[triangle][0];
    return std::sqrt(nearest_.squaredDistance(first)) > spacings * points_.spacings[nearest_.point(first)];
  }

  /// Drops triangles that a sensor saw through. But the filling of a hole of a closed surface is dropped or kept as a
  /// whole: it is dropped if most of it was seen through.
  void dropSeenThrough(std::vector<std::uint8_t>& keep)
  {
    const std::vector<std::int32_t> kept = fillings(keep);
    std::vector<Place> places;
    for (const std::int32_t t : kept) {
      const std::int32_t first = mesh_.triangles[t][0];
      const std::size_t point = nearest_.point(first);
      places.push_back({mesh_.vertices[first], clearance(points_.spacings[point], points_.deviation(point))});
    }
    const std::vector<std::uint8_t> isThrough = seenThrough(places, points_, execution_);
    std::vector<std::int32_t> fillingOf;
    std::vector<double> through(group(kept, fillingOf), 0);
    for (std::size_t n = 0; n < kept.size(); ++n)
      through[fillingOf[kept[n]]] += (isThrough[n] ? 1 : -1) * area(kept[n]);
    for (std::size_t n = 0; n < kept.size(); ++n)
      if (isOpen_[regionOf_[kept[n]]] ? isThrough[n] != 0 : through[fillingOf[kept[n]]] > 0)
        keep[kept[n]] = 0;
  }

  double area(std::size_t triangle) const { return areaOf(mesh_, mesh_.triangles[triangle]); }

  /// The unit normal.
  Eigen::Vector3f normalOf(std::int32_t triangle) const
  {
    const Triangle& corners = mesh_.triangles[triangle];
    const Eigen::Vector3f& a = mesh_.vertices[corners[0]];
    return (mesh_.vertices[corners[1]] - a).cross(mesh_.vertices[corners[2]] - a).normalized();
  }

  /// Drops parts of fillings that turn away from the surface around them. In parts that no sensor could see, it drops
  /// the triangles that face no sensor. \param from parts are formed by triangles farther than this from the points, in
  /// local spacings \param ifBeyond only parts that get farther than this are dropped
  void dropDoubtful(float from, float ifBeyond, std::vector<std::uint8_t>& keep)
  {
    std::vector<std::int32_t> judged;
    for (const std::int32_t t : fillings(keep))
      if (isBeyond(t, from))
        judged.push_back(t);
    if (judged.empty())
      return;
    struct Part {
      bool isWide = false;
      double turned = 0, unseen = 0; ///< integrals over the area of min cosine − cosine
    };
    const Viewpoints viewpoints(points_);
    std::vector<std::int32_t> partOf;
    std::vector<Part> parts(group(judged, partOf));
    std::vector<double> facing(judged.size(), 1);
    for (std::size_t n = 0; n < judged.size(); ++n) {
      const std::int32_t t = judged[n], first = mesh_.triangles[t][0];
      const Eigen::Vector3f normal = normalOf(t);
      if (viewpoints.areKnown())
        facing[n] = viewpoints.facing(mesh_.vertices[first], normal);
      Part& part = parts[partOf[t]];
      part.isWide = part.isWide || isBeyond(t, ifBeyond);
      part.turned += area(t) * (minContinuation - normal.dot(points_.normals[nearest_.point(first)]));
      part.unseen += area(t) * (minFacing - facing[n]);
    }
    for (std::size_t n = 0; n < judged.size(); ++n) {
      const Part& part = parts[partOf[judged[n]]];
      if (part.isWide && (part.turned > 0 || (part.unseen > 0 && facing[n] < minFacing)))
        keep[judged[n]] = 0;
    }
  }

  const TriangleMesh& mesh_;
  const std::vector<std::uint8_t>& supported_;
  const OrientedPoints& points_;
  Execution& execution_;
  NearestPoints nearest_;
  std::vector<std::int32_t> unsupported_; ///< triangles, ascending: most meshes have few
  std::vector<Region> regions_;
  std::vector<std::int32_t> regionOf_;     ///< per triangle; negative for supported ones
  std::vector<std::uint8_t> isOnBoundary_; ///< per vertex of unsupported triangles: the mesh ends there
  std::vector<std::uint8_t> isOpen_;       ///< per region: filling does not close its component
};

std::vector<std::uint8_t> findSupported(const TriangleMesh& mesh, Execution& execution)
{
  std::vector<std::uint8_t> supported(mesh.triangles.size());
  forTriangles(mesh, execution, [&](std::size_t t) {
    const Triangle& corners = mesh.triangles[t];
    supported[t] = hasValidIndices(mesh, t) && (mesh.confidences[corners[0]] > 0 || mesh.confidences[corners[1]] > 0 ||
                                                mesh.confidences[corners[2]] > 0);
  });
  return supported;
}

/// True if there is nothing to drop, and nothing to split.
bool isOnePiece(const MeshStatistics& statistics)
{
  return statistics.components == 1 && statistics.nonManifoldVertices == 0 && statistics.unusedVertices == 0;
}

bool areAllSet(const std::vector<std::uint8_t>& flags)
{
  return std::find(flags.begin(), flags.end(), std::uint8_t{0}) == flags.end();
}

} // namespace

float resolvedMaxHole(const TrimmingOptions& options, float diagonal)
{
  return options.maxHole > 0 ? options.maxHole : diagonal / 2;
}

float resolvedMaxGap(const TrimmingOptions& options, float diagonal)
{
  return options.maxGap > 0 ? options.maxGap : options.maxHole > 0 ? options.maxHole : .24f * diagonal;
}

TrimResult trim(TriangleMesh mesh, const OrientedPoints& points, const NeighborSearch& search, float diagonal,
                const TrimmingOptions& options, Execution& execution)
{
  validate(options);
  TrimResult result;
  if (options.kind == Trimming::none || mesh.triangles.empty()) {
    result.mesh = std::move(mesh);
    return result;
  }
  if (mesh.confidences.size() != mesh.vertices.size())
    throw std::invalid_argument("trim: needs one confidence per vertex");

  const std::vector<std::uint8_t> supported = findSupported(mesh, execution);
  if (areAllSet(supported)) {
    result.statistics = measure(mesh, execution);
    if (isOnePiece(*result.statistics)) { // as most large ones are: the rest would take memory and find nothing
      result.mesh = std::move(mesh);
      return result;
    }
  }
  HoleFinder holes(mesh, supported, points, search, execution);
  std::vector<std::uint8_t> keep(supported);
  if (options.kind == Trimming::holes) {
    const bool isAutomatic = options.maxGap == 0 && options.maxHole == 0;
    keep = holes.keepFillings({resolvedMaxHole(options, diagonal), resolvedMaxGap(options, diagonal), !isAutomatic});
  }
  bool isTorn = false;
  const bool keepsAll = areAllSet(keep);
  if (keepsAll && !result.statistics)
    result.statistics = measure(mesh, execution);
  if (!keepsAll || !isOnePiece(*result.statistics))
    result.componentsDropped = dropSmallComponents({mesh, supported}, points, search, options, keep, isTorn, execution);
  if (result.statistics && (result.componentsDropped > 0 || isTorn || result.statistics->unusedVertices > 0))
    result.statistics.reset(); // these hold for the mesh before

  for (std::size_t t = 0; t < keep.size(); ++t)
    if (!keep[t] && hasValidIndices(mesh, t))
      result.areaDropped += areaOf(mesh, mesh.triangles[t]);
  holes.describe(keep, result);
  result.mesh = result.statistics || (areAllSet(keep) && areAllSet(flagCorners(mesh, keep))) ? std::move(mesh)
                                                                                             : select(mesh, keep);
  if (isTorn)
    splitFans(result.mesh);
  return result;
}

} // namespace pcl::mrf

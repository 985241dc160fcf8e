#include "hole_filling.h"

#include "closing.h"
#include "mesh_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace pcl {
namespace mrf {
namespace {

/// More of a component than this is not the filling of holes but the back of what was seen from one side.
constexpr double mostFilled = 1. / 3;

/// What is farther from the points than this, in local spacings, is invented.
constexpr double inventedFrom = 10;

/// What is invented in a gap of an open surface goes on in the direction of the surface around it if it is a hole of
/// that: by a smaller mean cosine it bridges a step in depth, which a sensor could not see behind, and the gap is only
/// closed up to some local spacings. Measured with gaps of 24 % of the diagonal: .64 to 1 on views of heads, a face and
/// a bunny with four holes each, -.6 to .5 on Kinect frames and on a range scan of a dragon, a sliver of that excepted.
constexpr double minContinuation = .6;
constexpr double narrowGap = 28;

/// An edge-connected set of unsupported triangles.
struct Region {
  bool touchesBoundary = false;
  bool hasSupportedNeighbour = false;
  double area = 0;
  float squaredReach = 0; ///< largest squared distance of a vertex to the nearest data point

  bool isBounded() const { return hasSupportedNeighbour && !touchesBoundary; }
  double diameter() const { return 2 * std::sqrt(static_cast<double>(squaredReach)); }
};

constexpr std::int32_t noRegion = -1;

/// \param regionOf region of each triangle, noRegion where it is supported
/// \param isOnBoundary flags of the vertices of unsupported triangles where the mesh ends; stays empty without any
std::vector<Region> findRegions(const TriangleMesh& mesh, const Unsupported& unsupported,
                                const std::vector<std::uint8_t>& supported, Execution& execution,
                                std::vector<std::int32_t>& regionOf, std::vector<std::uint8_t>& isOnBoundary)
{
  std::vector<Region> regions;
  if (unsupported.triangles.empty()) {
    regionOf.assign(mesh.triangles.size(), noRegion);
    return regions;
  }
  std::vector<std::uint8_t> isMember(mesh.triangles.size(), 0);
  for (const std::int32_t t : unsupported.triangles)
    isMember[at(t)] = 1;
  bool isTorn;
  regions.resize(at(groupTriangles(mesh, isMember, execution, regionOf, isTorn)));
  isOnBoundary.assign(mesh.vertices.size(), 0);

  // What is beside the regions: all triangles with a corner there have their say about the edges.
  std::vector<std::uint8_t> isNear(mesh.vertices.size(), 0);
  for (const std::int32_t v : unsupported.vertices)
    isNear[at(v)] = 1;
  forTriangles(mesh, execution, [&](std::size_t t) {
    const Triangle& corners = mesh.triangles[t];
    isMember[t] =
        hasValidIndices(mesh, t) && (isNear[at(corners[0])] || isNear[at(corners[1])] || isNear[at(corners[2])]);
  });
  const VertexCorners corners = groupCorners(mesh, isMember);
  Ring ring;
  for (const std::int32_t v : unsupported.vertices) {
    ring.set(mesh, corners, v);
    ring.findEdges();
    for (const Ring::Edge& edge : ring.edges()) {
      const auto triangleOf = [&](const Ring::Side& side) { return at(ring.corner(side.at) / 3); };
      const auto isSupported = [&](const Ring::Side& side) { return supported[triangleOf(side)] != 0; };
      const bool anySupported = std::any_of(edge.begin, edge.end, isSupported);
      for (const Ring::Side* side = edge.begin; side < edge.end; ++side) {
        if (isSupported(*side))
          continue;
        Region& region = regions[at(regionOf[triangleOf(*side)])];
        region.touchesBoundary = region.touchesBoundary || edge.sides() == 1;
        if (edge.sides() == 1)
          isOnBoundary[at(v)] = 1;
        region.hasSupportedNeighbour = region.hasSupportedNeighbour || anySupported;
      }
    }
  }
  return regions;
}

/// Measures the regions for which `needs` holds.
template <typename Needs>
void measureReach(const TriangleMesh& mesh, const Unsupported& unsupported, const std::vector<std::int32_t>& regionOf,
                  const Needs& needs, DataDistances& distances, std::vector<Region>& regions)
{
  const auto isNeeded = [&](std::int32_t t) {
    return regionOf[at(t)] != noRegion && needs(regions[at(regionOf[at(t)])]);
  };
  distances.measure(unsupported.triangles, isNeeded);
  for (const std::int32_t t : unsupported.triangles)
    if (isNeeded(t))
      for (const std::int32_t v : mesh.triangles[at(t)]) {
        Region& region = regions[at(regionOf[at(t)])];
        region.squaredReach = std::max(region.squaredReach, distances.squared(v));
      }
}

/// Limits of one pass.
struct PassLimits : FillingLimits {
  double spacings = std::numeric_limits<double>::infinity(); ///< gap in local spacings of the points

  bool isLocal() const { return !std::isinf(spacings); }
};

/// Tells hole fillings from extrapolation.
class HoleFinder {
public:
  HoleFinder(const TriangleMesh& mesh, const Unsupported& unsupported, const std::vector<std::uint8_t>& supported,
             const std::vector<double>& areas, const OrientedPoints& points, const NeighbourSearch& search,
             const PassLimits& limits, DataDistances& distances, Execution& execution)
      : mesh_(mesh), unsupported_(unsupported), supported_(supported), areas_(areas), points_(points), search_(search),
        limits_(limits), distances_(distances), execution_(execution)
  {}

  /// Sets the flags of the unsupported triangles that fill holes.
  void keepFillings(std::vector<std::uint8_t>& keep)
  {
    std::vector<std::int32_t> regionOf;
    std::vector<std::uint8_t> isOnBoundary;
    std::vector<Region> regions = findRegions(mesh_, unsupported_, supported_, execution_, regionOf, isOnBoundary);
    if (regions.empty())
      return;
    const auto isBounded = [](const Region& region) { return region.isBounded(); };
    measureReach(mesh_, unsupported_, regionOf, isBounded, distances_, regions);
    const auto fitsInto = [](double limit) {
      return [limit](const Region& region) { return region.isBounded() && region.diameter() <= limit; };
    };
    const std::vector<std::uint8_t> isOpen = findOpenRegions(regions, regionOf, fitsInto(limits_.hole));
    // A limit in spacings of the rim is the closing's.
    const double onOpen = limits_.isLocal() ? 0 : std::min(limits_.gap, limits_.hole);
    for (const std::int32_t t : unsupported_.triangles) {
      const std::size_t r = at(regionOf[at(t)]);
      keep[at(t)] = fitsInto(isOpen[r] ? onOpen : limits_.hole)(regions[r]) ? 1 : 0;
    }
    keepGaps(isOnBoundary, keep);
  }

private:
  /// Flags of the regions whose component stays open even if all of its holes are filled, or of which so much would be
  /// filled that it is the back of what was seen from one side.
  template <typename IsHole>
  std::vector<std::uint8_t> findOpenRegions(const std::vector<Region>& regions,
                                            const std::vector<std::int32_t>& regionOf, const IsHole& isHole) const
  {
    std::vector<std::int32_t> componentOf;
    bool isTorn;
    const std::int32_t components = groupTriangles(mesh_, {}, execution_, componentOf, isTorn);
    std::vector<std::uint8_t> isOpenComponent(at(components), 0), isOpen(regions.size(), 0);
    std::vector<double> area(at(components), 0), unsupportedArea(at(components), 0);
    for (std::size_t t = 0; t < areas_.size(); ++t)
      if (componentOf[t] >= 0)
        area[at(componentOf[t])] += areas_[t];
    for (const std::int32_t t : unsupported_.triangles) {
      unsupportedArea[at(componentOf[at(t)])] += areas_[at(t)];
      if (!isHole(regions[at(regionOf[at(t)])]))
        isOpenComponent[at(componentOf[at(t)])] = 1;
    }
    for (std::size_t c = 0; c < area.size(); ++c)
      if (unsupportedArea[c] > mostFilled * area[c])
        isOpenComponent[c] = 1;
    for (const std::int32_t t : unsupported_.triangles)
      isOpen[at(regionOf[at(t)])] = isOpenComponent[at(componentOf[at(t)])];
    return isOpen;
  }

  /// Keeps what a closing fills of the triangles that are left.
  void keepGaps(const std::vector<std::uint8_t>& isOnBoundary, std::vector<std::uint8_t>& keep)
  {
    std::vector<std::uint8_t> isSheet(mesh_.triangles.size(), 0);
    std::vector<std::int32_t> sheet;
    for (const std::int32_t t : unsupported_.triangles)
      if (!keep[at(t)]) {
        isSheet[at(t)] = 1;
        sheet.push_back(t);
      }
    if (sheet.empty())
      return;
    std::vector<std::uint8_t> isRim(mesh_.vertices.size(), 0);
    for (std::size_t t = 0; t < keep.size(); ++t)
      if (keep[t])
        for (const std::int32_t v : mesh_.triangles[t])
          isRim[at(v)] = 1;
    std::vector<std::int32_t> rim;
    for (const std::int32_t t : sheet)
      for (const std::int32_t v : mesh_.triangles[at(t)])
        if (isRim[at(v)] == 1) {
          isRim[at(v)] = 2; // once
          rim.push_back(v);
        }
    const std::vector<std::uint8_t> isFilled =
        close(mesh_, groupCorners(mesh_, isSheet), describeRim(rim), isOnBoundary);
    const auto isInside = [&](std::int32_t v) { return isRim[at(v)] || isFilled[at(v)]; };
    for (const std::int32_t t : sheet) {
      const Triangle& corners = mesh_.triangles[at(t)];
      keep[at(t)] = isInside(corners[0]) && isInside(corners[1]) && isInside(corners[2]) ? 1 : 0;
    }
  }

  /// The support reaches beyond the data, but a hole is as wide as the data are apart.
  std::vector<RimVertex> describeRim(const std::vector<std::int32_t>& vertices) const
  {
    std::vector<RimVertex> rim(vertices.size());
    execution_.forRange(static_cast<std::int64_t>(rim.size()), 1024, [&](std::int64_t begin, std::int64_t end) {
      Neighbours nearest;
      for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n) {
        rim[n] = {vertices[n], 0, static_cast<float>(limits_.gap / 2)};
        if (search_.nearest(mesh_.vertices[at(vertices[n])], 1, nearest) < 1)
          continue;
        rim[n].distance = std::sqrt(nearest.squaredDistances.front());
        if (!limits_.isLocal())
          continue;
        const double spacing = points_.spacings[at(nearest.indices.front())];
        rim[n].radius = static_cast<float>(std::min(limits_.gap, limits_.spacings * spacing) / 2);
      }
    });
    return rim;
  }

  const TriangleMesh& mesh_;
  const Unsupported& unsupported_;
  const std::vector<std::uint8_t>& supported_;
  const std::vector<double>& areas_;
  const OrientedPoints& points_;
  const NeighbourSearch& search_;
  const PassLimits limits_;
  DataDistances& distances_;
  Execution& execution_;
};

/// Flags of the triangles of fillings that turn away from the surface around them.
std::vector<std::uint8_t> findBridges(const TriangleMesh& mesh, const OrientedPoints& points,
                                      const NeighbourSearch& search, const Unsupported& unsupported,
                                      const std::vector<std::uint8_t>& keep, const std::vector<double>& areas,
                                      Execution& execution)
{
  std::vector<std::uint8_t> isMember(mesh.triangles.size(), 0), isBridge(mesh.triangles.size(), 0);
  for (const std::int32_t t : unsupported.triangles)
    isMember[at(t)] = keep[at(t)];
  std::vector<std::int32_t> fillingOf;
  bool isTorn;
  const std::size_t fillings = at(groupTriangles(mesh, isMember, execution, fillingOf, isTorn));

  // Near the points the surface follows them in any case.
  std::vector<double> cosines(unsupported.triangles.size(), 0);
  std::vector<std::uint8_t> isInvented(unsupported.triangles.size(), 0);
  execution.forRange(static_cast<std::int64_t>(cosines.size()), 1024, [&](std::int64_t begin, std::int64_t end) {
    Neighbours nearest;
    for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n) {
      const std::int32_t t = unsupported.triangles[n];
      const Triangle& corners = mesh.triangles[at(t)];
      const Eigen::Vector3f& a = mesh.vertices[at(corners[0])];
      if (!keep[at(t)] || search.nearest(a, 1, nearest) < 1)
        continue;
      const double distance = std::sqrt(static_cast<double>(nearest.squaredDistances.front()));
      const int point = nearest.indices.front();
      const Eigen::Vector3f normal =
          (mesh.vertices[at(corners[1])] - a).cross(mesh.vertices[at(corners[2])] - a).normalized();
      cosines[n] = normal.dot(points.normals[at(point)]);
      isInvented[n] = distance > inventedFrom * points.spacings[at(point)] ? 1 : 0;
    }
  });
  std::vector<double> invented(fillings, 0), continued(fillings, 0);
  for (std::size_t n = 0; n < cosines.size(); ++n)
    if (isInvented[n]) {
      const std::int32_t t = unsupported.triangles[n];
      invented[at(fillingOf[at(t)])] += areas[at(t)];
      continued[at(fillingOf[at(t)])] += areas[at(t)] * cosines[n];
    }
  for (const std::int32_t t : unsupported.triangles)
    if (keep[at(t)]) {
      const std::size_t filling = at(fillingOf[at(t)]);
      isBridge[at(t)] = continued[filling] < minContinuation * invented[filling] ? 1 : 0;
    }
  return isBridge;
}

} // namespace

Unsupported::Unsupported(const TriangleMesh& mesh, const std::vector<std::uint8_t>& supported)
{
  for (std::size_t t = 0; t < supported.size(); ++t)
    if (!supported[t] && hasValidIndices(mesh, t))
      triangles.push_back(static_cast<std::int32_t>(t));
  std::vector<std::uint8_t> isTouched(triangles.empty() ? 0 : mesh.vertices.size(), 0);
  for (const std::int32_t t : triangles)
    for (const std::int32_t v : mesh.triangles[at(t)])
      isTouched[at(v)] = 1;
  for (std::size_t v = 0; v < isTouched.size(); ++v)
    if (isTouched[v])
      vertices.push_back(static_cast<std::int32_t>(v));
}

std::vector<std::uint8_t> keepFillings(const TriangleMesh& mesh, const Unsupported& unsupported,
                                       const std::vector<std::uint8_t>& supported, const std::vector<double>& areas,
                                       const OrientedPoints& points, const NeighbourSearch& search,
                                       const FillingLimits& limits, bool closesBridges, DataDistances& distances,
                                       Execution& execution)
{
  const auto fill = [&](const PassLimits& pass) {
    std::vector<std::uint8_t> keep(supported);
    HoleFinder(mesh, unsupported, supported, areas, points, search, pass, distances, execution).keepFillings(keep);
    return keep;
  };
  PassLimits pass;
  pass.hole = limits.hole;
  pass.gap = limits.gap;
  std::vector<std::uint8_t> keep = fill(pass);
  if (closesBridges || points.spacings.empty())
    return keep;
  const auto isBridge = findBridges(mesh, points, search, unsupported, keep, areas, execution);
  if (std::find(isBridge.begin(), isBridge.end(), std::uint8_t{1}) == isBridge.end())
    return keep;
  pass.spacings = narrowGap;
  const std::vector<std::uint8_t> narrow = fill(pass);
  for (const std::int32_t t : unsupported.triangles)
    if (isBridge[at(t)])
      keep[at(t)] = narrow[at(t)];
  return keep;
}

void describeFillings(const TriangleMesh& mesh, const Unsupported& unsupported, const std::vector<std::uint8_t>& keep,
                      const std::vector<double>& areas, DataDistances& distances, TrimResult& result,
                      Execution& execution)
{
  std::vector<std::uint8_t> isMember(mesh.triangles.size(), 0);
  const auto group = [&](std::uint8_t kept, std::vector<std::int32_t>& regionOf) {
    for (const std::int32_t t : unsupported.triangles)
      isMember[at(t)] = keep[at(t)] == kept ? 1 : 0;
    bool isTorn;
    return groupTriangles(mesh, isMember, execution, regionOf, isTorn);
  };
  std::vector<std::int32_t> regionOf;
  result.extrapolationsDropped = group(0, regionOf);
  std::vector<Region> fillings(at(group(1, regionOf)));
  for (const std::int32_t t : unsupported.triangles)
    if (keep[at(t)])
      fillings[at(regionOf[at(t)])].area += areas[at(t)];
  measureReach(
      mesh, unsupported, regionOf, [](const Region&) { return true; }, distances, fillings);
  result.holesFilled = static_cast<std::int64_t>(fillings.size());
  for (const Region& filling : fillings) {
    result.areaFilled += filling.area;
    result.largestHole = std::max(result.largestHole, filling.diameter());
  }
}

} // namespace mrf
} // namespace pcl

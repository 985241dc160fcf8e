#include "closing.h"
#include "mesh_topology.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/trimming.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace pcl {
namespace mrf {
namespace {

std::size_t at(std::int32_t index)
{
  return static_cast<std::size_t>(index);
}

constexpr std::int64_t grain = 16384;

/// More of a component than this is not the filling of holes but the back of what was seen from one side.
constexpr double mostFilled = 1. / 3;

/// What is farther from the points than this, in local spacings, is invented.
constexpr double inventedFrom = 5;

/// What is invented in a gap of an open surface goes on in the direction of the surface around it if it is a hole of
/// that: by a smaller mean cosine it bridges a step in depth, which a sensor could not see behind, and the gap is only
/// closed up to some local spacings. Measured with gaps of 24 % of the diagonal: .64 to 1 on views of heads, a face and
/// a bunny with four holes each, -.6 to .5 on Kinect frames and on a range scan of a dragon, a sliver of that excepted.
constexpr double minContinuation = .6;
constexpr double narrowGap = 14;

/// Calls body(t) for all triangles, concurrently.
template <typename Body>
void forTriangles(const TriangleMesh& mesh, Execution& execution, const Body& body)
{
  execution.forRange(static_cast<std::int64_t>(mesh.triangles.size()), grain,
                     [&](std::int64_t begin, std::int64_t end) {
                       for (auto t = static_cast<std::size_t>(begin); t < static_cast<std::size_t>(end); ++t)
                         body(t);
                     });
}

std::vector<double> findAreas(const TriangleMesh& mesh, Execution& execution)
{
  std::vector<double> areas(mesh.triangles.size());
  forTriangles(mesh, execution, [&](std::size_t t) {
    if (!hasValidIndices(mesh, t))
      return;
    const Triangle& corners = mesh.triangles[t];
    const Eigen::Vector3d a = mesh.vertices[at(corners[0])].cast<double>(),
                          b = mesh.vertices[at(corners[1])].cast<double>(),
                          c = mesh.vertices[at(corners[2])].cast<double>();
    areas[t] = (b - a).cross(c - a).norm() / 2;
  });
  return areas;
}

std::vector<std::uint8_t> findSupported(const TriangleMesh& mesh, Execution& execution)
{
  std::vector<std::uint8_t> supported(mesh.triangles.size());
  forTriangles(mesh, execution, [&](std::size_t t) {
    const Triangle& corners = mesh.triangles[t];
    supported[t] =
        hasValidIndices(mesh, t) && (mesh.confidences[at(corners[0])] > 0 || mesh.confidences[at(corners[1])] > 0 ||
                                     mesh.confidences[at(corners[2])] > 0);
  });
  return supported;
}

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

/// The triangles without support and their vertices, ascending: most meshes have few, and none of the rest is visited.
struct Unsupported {
  std::vector<std::int32_t> triangles, vertices;

  Unsupported(const TriangleMesh& mesh, const std::vector<std::uint8_t>& supported)
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
};

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

/// Distances to the nearest data point, measured where they are asked for, each once.
class DataDistances {
public:
  DataDistances(const TriangleMesh& mesh, const Unsupported& unsupported, const NeighbourSearch& search,
                Execution& execution)
      : mesh_(mesh), vertices_(unsupported.vertices), search_(search), execution_(execution),
        squared_(vertices_.size(), unknown)
  {}

  /// Squared distance of a vertex of an unsupported triangle. \pre it was measured
  float squared(std::int32_t vertex) const { return squared_[placeOf(vertex)]; }

  /// Measures the vertices of those triangles for which `needs` holds.
  template <typename Needs>
  void measure(const std::vector<std::int32_t>& triangles, const Needs& needs)
  {
    std::vector<std::uint8_t> isNeeded(vertices_.size(), 0);
    for (const std::int32_t t : triangles)
      if (needs(t))
        for (const std::int32_t v : mesh_.triangles[at(t)])
          isNeeded[placeOf(v)] = 1;
    execution_.forRange(static_cast<std::int64_t>(isNeeded.size()), 1024, [&](std::int64_t begin, std::int64_t end) {
      Neighbours nearest;
      for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n)
        if (isNeeded[n] && squared_[n] == unknown && search_.nearest(mesh_.vertices[at(vertices_[n])], 1, nearest) > 0)
          squared_[n] = nearest.squaredDistances.front();
    });
  }

private:
  static constexpr float unknown = -1;

  std::size_t placeOf(std::int32_t vertex) const
  {
    return static_cast<std::size_t>(std::lower_bound(vertices_.begin(), vertices_.end(), vertex) - vertices_.begin());
  }

  const TriangleMesh& mesh_;
  const std::vector<std::int32_t>& vertices_;
  const NeighbourSearch& search_;
  Execution& execution_;
  std::vector<float> squared_; ///< of unsupported.vertices
};

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

/// Side of the square that a point stands for, by its eight nearest neighbours; 0 for a single point.
double spacingAt(const OrientedPoints& points, const NeighbourSearch& search, int point, Neighbours& scratch)
{
  constexpr int around = 8;
  const double pi = 3.14159265358979323846;
  const int found = search.nearest(points.positions[at(point)], around + 1, scratch);
  return found < 2 ? 0 : std::sqrt(pi * static_cast<double>(scratch.squaredDistances[at(found - 1)]) / (found - 1));
}

/// How wide what is filled may be, cloud's unit.
struct FillingLimits {
  double hole;                                               ///< where filling closes the surface
  double gap;                                                ///< elsewhere
  double spacings = std::numeric_limits<double>::infinity(); ///< the same in local spacings of the points

  bool isLocal() const { return !std::isinf(spacings); }
};

/// Tells hole fillings from extrapolation.
class HoleFinder {
public:
  HoleFinder(const TriangleMesh& mesh, const Unsupported& unsupported, const std::vector<std::uint8_t>& supported,
             const std::vector<double>& areas, const OrientedPoints& points, const NeighbourSearch& search,
             const FillingLimits& limits, DataDistances& distances, Execution& execution)
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
        const double spacing = spacingAt(points_, search_, nearest.indices.front(), nearest);
        if (spacing > 0)
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
  const FillingLimits limits_;
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
      isInvented[n] = distance > inventedFrom * spacingAt(points, search, point, nearest) ? 1 : 0;
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

/// Counts and measures what became of the unsupported triangles.
void describe(const TriangleMesh& mesh, const Unsupported& unsupported, const std::vector<std::uint8_t>& keep,
              const std::vector<double>& areas, DataDistances& distances, TrimResult& result, Execution& execution)
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

/// Vertices with support of a component that are asked for the points behind it.
constexpr std::size_t mostAsked = 1024;

/// Of each component some vertices with support, spread evenly over them.
std::vector<std::vector<std::int32_t>>
pickVertices(const TriangleMesh& mesh, const std::vector<std::int32_t>& componentOf, std::size_t components)
{
  std::vector<std::vector<std::int32_t>> picked(components);
  std::vector<std::uint8_t> isSeen(mesh.vertices.size(), 0);
  for (std::size_t t = 0; t < componentOf.size(); ++t) {
    if (componentOf[t] < 0)
      continue;
    for (const std::int32_t v : mesh.triangles[t])
      if (!isSeen[at(v)] && mesh.confidences[at(v)] > 0) {
        isSeen[at(v)] = 1;
        picked[at(componentOf[t])].push_back(v);
      }
  }
  for (std::vector<std::int32_t>& vertices : picked) {
    const std::size_t count = std::min(vertices.size(), mostAsked);
    for (std::size_t n = 0; n < count; ++n)
      vertices[n] = vertices[n * vertices.size() / count];
    vertices.resize(count);
  }
  return picked;
}

/// Counts the points that speak for a component of the mesh. A point stands behind it if no other component is closer;
/// it is coherent if the normals of a third of its neighbours that stand there, and of two at least, agree with its
/// own, which outliers' do not. It is apart if those two are closer than any other component: no other surface accounts
/// for it.
class Witnesses {
public:
  Witnesses(const TriangleMesh& mesh, const OrientedPoints& points, const NeighbourSearch& search,
            const std::vector<std::int32_t>& componentOf, Execution& execution)
      : mesh_(mesh), points_(points), search_(search), vertexSearch_(makePointBins()),
        componentOfVertex_(mesh.vertices.size(), noRegion)
  {
    for (std::size_t t = 0; t < componentOf.size(); ++t)
      if (componentOf[t] >= 0)
        for (const std::int32_t v : mesh.triangles[t])
          componentOfVertex_[at(v)] = componentOf[t];
    vertexSearch_->setPoints(mesh.vertices, execution);
  }

  /// True if `fewest` coherent points are found at the vertices, or `fewestApart` of them apart.
  bool suffice(std::int32_t component, const std::vector<std::int32_t>& vertices, std::size_t fewest,
               std::size_t fewestApart) const
  {
    std::vector<int> asked;
    std::size_t coherent = 0, apart = 0;
    Neighbours nearest;
    for (const std::int32_t v : vertices) {
      if (search_.nearest(mesh_.vertices[at(v)], 1, nearest) < 1)
        continue;
      const int point = nearest.indices.front();
      if (std::find(asked.begin(), asked.end(), point) != asked.end())
        continue;
      asked.push_back(point);
      if (componentBehind(point, nearest) != component)
        continue;
      const float reach = reachOfFellows(point, component, nearest);
      if (!(reach > 0))
        continue;
      ++coherent;
      apart += isAlone(point, component, reach, nearest) ? 1 : 0;
      if (coherent >= fewest || apart >= fewestApart)
        return true;
    }
    return false;
  }

private:
  std::int32_t componentBehind(int point, Neighbours& scratch) const
  {
    vertexSearch_->nearest(points_.positions[at(point)], 1, scratch);
    return componentOfVertex_[at(scratch.indices.front())];
  }

  /// Distance of the second fellow that agrees; 0 if there are not two, or not a third of them.
  float reachOfFellows(int point, std::int32_t component, Neighbours& scratch) const
  {
    constexpr int around = 8;
    Neighbours neighbours;
    search_.nearest(points_.positions[at(point)], around + 1, neighbours);
    int fellows = 0, agreeing = 0;
    float reach = 0;
    for (std::size_t n = 0; n < neighbours.indices.size(); ++n) {
      const int other = neighbours.indices[n];
      if (neighbours.squaredDistances[n] == 0 || componentBehind(other, scratch) != component)
        continue;
      ++fellows;
      if (points_.normals[at(other)].dot(points_.normals[at(point)]) > minAgreement && ++agreeing == 2)
        reach = std::sqrt(neighbours.squaredDistances[n]);
    }
    return 3 * agreeing >= fellows ? reach : 0;
  }

  bool isAlone(int point, std::int32_t component, float reach, Neighbours& scratch) const
  {
    vertexSearch_->within(points_.positions[at(point)], reach, scratch);
    return std::all_of(scratch.indices.begin(), scratch.indices.end(),
                       [&](int v) { return componentOfVertex_[at(v)] == component; });
  }

  /// Cosine of 40°: one in nine pairs of random directions agrees, one in 70 triples.
  static constexpr float minAgreement = .766f;

  const TriangleMesh& mesh_;
  const OrientedPoints& points_;
  const NeighbourSearch& search_;
  const std::unique_ptr<NeighbourSearch> vertexSearch_;
  std::vector<std::int32_t> componentOfVertex_;
};

/// As few coherent points make a surface where there is no other: a lone corner of a range scan, a strip of one line.
constexpr std::size_t fewestApart = 3;

/// The components that too few points speak for, however large they are.
std::vector<std::uint8_t> findPoorComponents(const TriangleMesh& mesh, const OrientedPoints& points,
                                             const NeighbourSearch& search,
                                             const std::vector<std::int32_t>& componentOf, std::size_t components,
                                             std::size_t fewest, Execution& execution)
{
  std::vector<std::uint8_t> isPoor(components, 0);
  if (fewest < 2)
    return isPoor;
  const std::vector<std::vector<std::int32_t>> picked = pickVertices(mesh, componentOf, components);
  const Witnesses witnesses(mesh, points, search, componentOf, execution);
  execution.forRange(static_cast<std::int64_t>(components), 1, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t c = begin; c < end; ++c) {
      const auto component = static_cast<std::size_t>(c);
      isPoor[component] =
          witnesses.suffice(static_cast<std::int32_t>(c), picked[component], fewest, fewestApart) ? 0 : 1;
    }
  });
  return isPoor;
}

/// Clears the flags of the triangles in components that too few points speak for or with too little supported area; the
/// largest one, by that area, always stays. \return how many components \param isTorn receives whether the kept
/// triangles around some vertex fall into several fans
std::int64_t dropSmallComponents(const TriangleMesh& mesh, const OrientedPoints& points, const NeighbourSearch& search,
                                 const std::vector<std::uint8_t>& supported, const std::vector<double>& areas,
                                 const TrimmingOptions& options, std::vector<std::uint8_t>& keep, bool& isTorn,
                                 Execution& execution)
{
  std::vector<std::int32_t> componentOf;
  const std::int32_t components = groupTriangles(mesh, keep, execution, componentOf, isTorn);
  if (components < 2)
    return 0;
  std::vector<double> area(at(components), 0);
  double total = 0;
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (keep[t] && supported[t]) {
      area[at(componentOf[t])] += areas[t];
      total += areas[t];
    }
  std::vector<std::uint8_t> isDropped = findPoorComponents(
      mesh, points, search, componentOf, area.size(), static_cast<std::size_t>(options.minComponentPoints), execution);
  for (std::size_t c = 0; c < area.size(); ++c)
    if (area[c] < options.minComponentShare * total)
      isDropped[c] = 1;
  isDropped[static_cast<std::size_t>(std::max_element(area.begin(), area.end()) - area.begin())] = 0;
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (keep[t] && isDropped[at(componentOf[t])])
      keep[t] = 0;
  return std::count(isDropped.begin(), isDropped.end(), std::uint8_t{1});
}

/// True if there is nothing to drop, and nothing to split.
bool isOnePiece(const MeshStatistics& statistics)
{
  return statistics.components == 1 && statistics.nonManifoldVertices == 0 && statistics.unusedVertices == 0;
}

/// True if all triangles are kept and use all vertices.
bool isAllUsed(const TriangleMesh& mesh, const std::vector<std::uint8_t>& keep)
{
  const auto isSet = [](std::uint8_t flag) { return flag != 0; };
  if (!std::all_of(keep.begin(), keep.end(), isSet))
    return false;
  std::vector<std::uint8_t> isUsed(mesh.vertices.size(), 0);
  for (const Triangle& t : mesh.triangles)
    for (const std::int32_t v : t)
      isUsed[at(v)] = 1;
  return std::all_of(isUsed.begin(), isUsed.end(), isSet);
}

} // namespace

void validate(const TrimmingOptions& options)
{
  const auto refuse = [](const char* name, auto value, const char* range) {
    std::ostringstream text;
    text << "trimming." << name << " = " << value << " is outside its range " << range;
    throw InvalidOption(text.str());
  };
  if (!(options.maxHole >= 0) || std::isinf(options.maxHole))
    refuse("maxHole", options.maxHole, "0 or more (0 = half the diagonal of the points' bounding box)");
  if (!(options.maxGap >= 0) || std::isinf(options.maxGap))
    refuse("maxGap", options.maxGap, "0 or more (0 = maxHole, or 24 % of the diagonal of the points' bounding box)");
  if (options.minComponentPoints < 0 || options.minComponentPoints > 1000000)
    refuse("minComponentPoints", options.minComponentPoints, "0..1000000");
  if (!(options.minComponentShare >= 0 && options.minComponentShare < 1))
    refuse("minComponentShare", options.minComponentShare, "[0, 1)");
}

float resolvedMaxHole(const TrimmingOptions& options, float diagonal)
{
  return options.maxHole > 0 ? options.maxHole : diagonal / 2;
}

float resolvedMaxGap(const TrimmingOptions& options, float diagonal)
{
  return options.maxGap > 0 ? options.maxGap : options.maxHole > 0 ? options.maxHole : .24f * diagonal;
}

TrimResult trim(TriangleMesh mesh, const OrientedPoints& points, const NeighbourSearch& search, float diagonal,
                const TrimmingOptions& options, Execution& execution)
{
  validate(options);
  TrimResult result;
  if (options.trimming == Trimming::none || mesh.triangles.empty()) {
    result.mesh = std::move(mesh);
    return result;
  }
  if (mesh.confidences.size() != mesh.vertices.size())
    throw std::invalid_argument("trim: needs one confidence per vertex");

  const std::vector<std::uint8_t> supported = findSupported(mesh, execution);
  const std::vector<double> areas = findAreas(mesh, execution);
  const Unsupported unsupported(mesh, supported);
  DataDistances distances(mesh, unsupported, search, execution);
  std::vector<std::uint8_t> keep(supported);
  if (options.trimming == Trimming::holes && !unsupported.triangles.empty()) {
    const auto fill = [&](const FillingLimits& limits) {
      std::vector<std::uint8_t> filled(supported);
      HoleFinder(mesh, unsupported, supported, areas, points, search, limits, distances, execution)
          .keepFillings(filled);
      return filled;
    };
    FillingLimits limits{resolvedMaxHole(options, diagonal), resolvedMaxGap(options, diagonal)};
    keep = fill(limits);
    if (options.maxGap == 0 && options.maxHole == 0) {
      const auto isBridge = findBridges(mesh, points, search, unsupported, keep, areas, execution);
      if (std::find(isBridge.begin(), isBridge.end(), std::uint8_t{1}) != isBridge.end()) {
        limits.spacings = narrowGap;
        const std::vector<std::uint8_t> narrow = fill(limits);
        for (const std::int32_t t : unsupported.triangles)
          if (isBridge[at(t)])
            keep[at(t)] = narrow[at(t)];
      }
    }
  }
  bool isTorn = false;
  const bool keepsAll = std::all_of(keep.begin(), keep.end(), [](std::uint8_t flag) { return flag != 0; });
  if (keepsAll)
    result.statistics = measure(mesh, execution);
  if (!keepsAll || !isOnePiece(*result.statistics))
    result.componentsDropped =
        dropSmallComponents(mesh, points, search, supported, areas, options, keep, isTorn, execution);
  if (result.statistics && (result.componentsDropped > 0 || isTorn || result.statistics->unusedVertices > 0))
    result.statistics.reset(); // not those of what is left

  for (std::size_t t = 0; t < keep.size(); ++t)
    if (!keep[t])
      result.areaDropped += areas[t];
  if (!unsupported.triangles.empty())
    describe(mesh, unsupported, keep, areas, distances, result, execution);
  result.mesh = result.statistics || isAllUsed(mesh, keep) ? std::move(mesh) : select(mesh, keep);
  if (isTorn)
    splitFans(result.mesh);
  return result;
}

} // namespace mrf
} // namespace pcl

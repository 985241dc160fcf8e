#include "mesh_topology.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/trimming.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
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

  bool mayBeHole() const { return hasSupportedNeighbour && !touchesBoundary; }
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
std::vector<Region> findRegions(const TriangleMesh& mesh, const Unsupported& unsupported,
                                const std::vector<std::uint8_t>& supported, const std::vector<double>& areas,
                                Execution& execution, std::vector<std::int32_t>& regionOf)
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
  for (const std::int32_t t : unsupported.triangles)
    regions[at(regionOf[at(t)])].area += areas[at(t)];

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
        region.hasSupportedNeighbour = region.hasSupportedNeighbour || anySupported;
      }
    }
  }
  return regions;
}

/// Sets squaredReach of the regions that may be hole fillings.
void measureReach(const TriangleMesh& mesh, const Unsupported& unsupported, const std::vector<std::int32_t>& regionOf,
                  const NeighbourSearch& search, std::vector<Region>& regions, Execution& execution)
{
  // By the vertex's number among those without support.
  std::vector<std::uint8_t> needed(unsupported.vertices.size(), 0);
  const auto forEachCorner = [&](const auto& visit) {
    for (const std::int32_t t : unsupported.triangles) {
      Region& region = regions[at(regionOf[at(t)])];
      if (!region.mayBeHole())
        continue;
      for (const std::int32_t v : mesh.triangles[at(t)]) {
        const auto place = std::lower_bound(unsupported.vertices.begin(), unsupported.vertices.end(), v);
        visit(region, static_cast<std::size_t>(place - unsupported.vertices.begin()));
      }
    }
  };
  forEachCorner([&](Region&, std::size_t n) { needed[n] = 1; });

  std::vector<float> squaredDistance(unsupported.vertices.size(), 0);
  execution.forRange(static_cast<std::int64_t>(needed.size()), 1024, [&](std::int64_t begin, std::int64_t end) {
    Neighbours nearest;
    for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n)
      if (needed[n] && search.nearest(mesh.vertices[at(unsupported.vertices[n])], 1, nearest) > 0)
        squaredDistance[n] = nearest.squaredDistances.front();
  });
  forEachCorner(
      [&](Region& region, std::size_t n) { region.squaredReach = std::max(region.squaredReach, squaredDistance[n]); });
}

/// Vertices with support of a component that are asked for the points behind it.
constexpr std::size_t mostAsked = 1024;

/// Of each component some vertices with support, spread evenly over them.
std::vector<std::vector<std::int32_t>> pickVertices(const TriangleMesh& mesh,
                                                    const std::vector<std::int32_t>& componentOf,
                                                    std::size_t components)
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

/// The components that have fewer than `fewest` points behind them: the nearest ones of their vertices with support, if
/// no other component is closer to them. An outlier stands alone in its bubble, however large that is beside a small
/// cloud; an object has about as many points as vertices, however small it is beside a large one.
std::vector<std::uint8_t> findPoorComponents(const TriangleMesh& mesh, const OrientedPoints& points,
                                             const NeighbourSearch& search,
                                             const std::vector<std::int32_t>& componentOf, std::size_t components,
                                             std::size_t fewest, Execution& execution)
{
  std::vector<std::uint8_t> isPoor(components, 0);
  if (fewest < 2)
    return isPoor;
  std::vector<std::int32_t> componentOfVertex(mesh.vertices.size(), noRegion);
  for (std::size_t t = 0; t < componentOf.size(); ++t)
    if (componentOf[t] >= 0)
      for (const std::int32_t v : mesh.triangles[t])
        componentOfVertex[at(v)] = componentOf[t];
  const std::vector<std::vector<std::int32_t>> picked = pickVertices(mesh, componentOf, components);
  const auto vertexSearch = makePointBins();
  vertexSearch->setPoints(mesh.vertices, execution);
  execution.forRange(static_cast<std::int64_t>(components), 1, [&](std::int64_t begin, std::int64_t end) {
    Neighbours nearest;
    for (auto c = static_cast<std::size_t>(begin); c < static_cast<std::size_t>(end); ++c) {
      std::vector<int> behind;
      for (std::size_t n = 0; n < picked[c].size() && behind.size() < fewest; ++n) {
        if (search.nearest(mesh.vertices[at(picked[c][n])], 1, nearest) < 1)
          continue;
        const int point = nearest.indices.front();
        vertexSearch->nearest(points.positions[at(point)], 1, nearest);
        if (componentOfVertex[at(nearest.indices.front())] == static_cast<std::int32_t>(c) &&
            std::find(behind.begin(), behind.end(), point) == behind.end())
          behind.push_back(point);
      }
      isPoor[c] = behind.size() < fewest ? 1 : 0;
    }
  });
  return isPoor;
}

/// Clears the flags of the triangles in components with too few points or too little supported area; the largest one,
/// by that area, always stays. \return how many components
/// \param isTorn receives whether the kept triangles around some vertex fall into several fans
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
  std::vector<std::uint8_t> isDropped =
      findPoorComponents(mesh, points, search, componentOf, area.size(),
                         static_cast<std::size_t>(options.minComponentPoints), execution);
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
  if (options.minComponentPoints < 0 || options.minComponentPoints > 1000000)
    refuse("minComponentPoints", options.minComponentPoints, "0..1000000");
  if (!(options.minComponentShare >= 0 && options.minComponentShare < 1))
    refuse("minComponentShare", options.minComponentShare, "[0, 1)");
}

float resolvedMaxHole(const TrimmingOptions& options, float diagonal)
{
  return options.maxHole > 0 ? options.maxHole : diagonal / 2;
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
  std::vector<std::int32_t> regionOf;
  std::vector<Region> regions = findRegions(mesh, unsupported, supported, areas, execution, regionOf);
  std::vector<std::uint8_t> keep(supported);
  if (options.trimming == Trimming::holes) {
    measureReach(mesh, unsupported, regionOf, search, regions, execution);
    const double maxHole = resolvedMaxHole(options, diagonal);
    for (const std::int32_t t : unsupported.triangles) {
      const Region& region = regions[at(regionOf[at(t)])];
      keep[at(t)] = region.mayBeHole() && region.diameter() <= maxHole ? 1 : 0;
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

  // A region is kept or dropped as a whole.
  std::vector<std::uint8_t> isKept(regions.size(), 0);
  for (const std::int32_t t : unsupported.triangles)
    isKept[at(regionOf[at(t)])] = keep[at(t)];
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (!keep[t])
      result.areaDropped += areas[t];
  for (std::size_t r = 0; r < regions.size(); ++r) {
    if (!isKept[r]) {
      ++result.extrapolationsDropped;
      continue;
    }
    ++result.holesFilled;
    result.areaFilled += regions[r].area;
    result.largestHole = std::max(result.largestHole, regions[r].diameter());
  }
  result.mesh = result.statistics || isAllUsed(mesh, keep) ? std::move(mesh) : select(mesh, keep);
  if (isTorn)
    splitFans(result.mesh);
  return result;
}

} // namespace mrf
} // namespace pcl

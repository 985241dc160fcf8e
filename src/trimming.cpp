#include "mesh_topology.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/trimming.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace pcl {
namespace mrf {
namespace {

std::size_t at(std::int32_t index)
{
  return static_cast<std::size_t>(index);
}

double areaOf(const TriangleMesh& mesh, std::size_t triangle)
{
  const Triangle& t = mesh.triangles[triangle];
  const Eigen::Vector3d a = mesh.vertices[at(t[0])].cast<double>(), b = mesh.vertices[at(t[1])].cast<double>(),
                        c = mesh.vertices[at(t[2])].cast<double>();
  return (b - a).cross(c - a).norm() / 2;
}

std::vector<std::uint8_t> findSupported(const TriangleMesh& mesh)
{
  std::vector<std::uint8_t> supported;
  supported.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles)
    supported.push_back(
        std::any_of(t.begin(), t.end(), [&](std::int32_t v) { return mesh.confidences[at(v)] > 0; }) ? 1 : 0);
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

/// \param regionOf region of each triangle, noRegion where it is supported
std::vector<Region> findRegions(const TriangleMesh& mesh, const EdgeSides& edges,
                                const std::vector<std::uint8_t>& supported, std::vector<std::int32_t>& regionOf)
{
  std::vector<std::uint8_t> unsupported;
  for (const std::uint8_t flag : supported)
    unsupported.push_back(flag ? 0 : 1);
  DisjointSets sets = groupTriangles(edges, unsupported);
  std::vector<Region> regions;
  regionOf.assign(mesh.triangles.size(), noRegion);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (supported[t])
      continue;
    const std::size_t first = at(sets.find(static_cast<std::int32_t>(t)));
    if (first == t) {
      regionOf[t] = static_cast<std::int32_t>(regions.size());
      regions.emplace_back();
    }
    regionOf[t] = regionOf[first];
    regions[at(regionOf[t])].area += areaOf(mesh, t);
  }
  for (std::size_t e = 0; e < edges.count(); ++e) {
    const auto isSupported = [&](std::int32_t n) { return supported[at(edges.side(e, n) / 3)] != 0; };
    bool anySupported = false;
    for (std::int32_t n = 0; n < edges.sidesOf(e); ++n)
      anySupported = anySupported || isSupported(n);
    for (std::int32_t n = 0; n < edges.sidesOf(e); ++n) {
      if (isSupported(n))
        continue;
      Region& region = regions[at(regionOf[at(edges.side(e, n) / 3)])];
      region.touchesBoundary = region.touchesBoundary || edges.sidesOf(e) == 1;
      region.hasSupportedNeighbour = region.hasSupportedNeighbour || anySupported;
    }
  }
  return regions;
}

/// Sets squaredReach of the regions that may be hole fillings.
void measureReach(const TriangleMesh& mesh, const std::vector<std::int32_t>& regionOf, const NeighbourSearch& search,
                  std::vector<Region>& regions, Execution& execution)
{
  std::vector<std::uint8_t> needed(mesh.vertices.size(), 0);
  const auto forEachCorner = [&](const auto& visit) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      if (regionOf[t] != noRegion && regions[at(regionOf[t])].mayBeHole())
        for (const std::int32_t v : mesh.triangles[t])
          visit(regions[at(regionOf[t])], at(v));
  };
  forEachCorner([&](Region&, std::size_t v) { needed[v] = 1; });

  std::vector<float> squaredDistance(mesh.vertices.size(), 0);
  execution.forRange(static_cast<std::int64_t>(mesh.vertices.size()), 1024, [&](std::int64_t begin, std::int64_t end) {
    Neighbours nearest;
    for (auto v = static_cast<std::size_t>(begin); v < static_cast<std::size_t>(end); ++v)
      if (needed[v] && search.nearest(mesh.vertices[v], 1, nearest) > 0)
        squaredDistance[v] = nearest.squaredDistances.front();
  });
  forEachCorner(
      [&](Region& region, std::size_t v) { region.squaredReach = std::max(region.squaredReach, squaredDistance[v]); });
}

/// Clears the flags of the triangles in components with too little supported area. \return how many components
std::int64_t dropSmallComponents(const TriangleMesh& mesh, const EdgeSides& edges,
                                 const std::vector<std::uint8_t>& supported, double minShare,
                                 std::vector<std::uint8_t>& keep)
{
  DisjointSets components = groupTriangles(edges, keep);
  const auto firstOf = [&](std::size_t t) { return at(components.find(static_cast<std::int32_t>(t))); };
  std::vector<double> area(keep.size(), 0); // of a component, at its first triangle
  double total = 0;
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (keep[t] && supported[t]) {
      const double triangleArea = areaOf(mesh, t);
      area[firstOf(t)] += triangleArea;
      total += triangleArea;
    }
  std::int64_t dropped = 0;
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (keep[t] && area[firstOf(t)] < minShare * total) {
      keep[t] = 0;
      dropped += firstOf(t) == t ? 1 : 0;
    }
  return dropped;
}

} // namespace

void validate(const TrimmingOptions& options)
{
  const auto refuse = [](const char* name, float value, const char* range) {
    std::ostringstream text;
    text << "trimming." << name << " = " << value << " is outside its range " << range;
    throw InvalidOption(text.str());
  };
  if (!(options.maxHole >= 0) || std::isinf(options.maxHole))
    refuse("maxHole", options.maxHole, "0 or more (0 = half the diagonal of the points' bounding box)");
  if (!(options.minComponentShare >= 0 && options.minComponentShare < 1))
    refuse("minComponentShare", options.minComponentShare, "[0, 1)");
}

float resolvedMaxHole(const TrimmingOptions& options, float diagonal)
{
  return options.maxHole > 0 ? options.maxHole : diagonal / 2;
}

TrimResult trim(const TriangleMesh& mesh, const NeighbourSearch& search, float diagonal, const TrimmingOptions& options,
                Execution& execution)
{
  validate(options);
  TrimResult result;
  if (options.trimming == Trimming::none || mesh.triangles.empty()) {
    result.mesh = mesh;
    return result;
  }
  if (mesh.confidences.size() != mesh.vertices.size())
    throw std::invalid_argument("trim: needs one confidence per vertex");

  const std::vector<std::uint8_t> supported = findSupported(mesh);
  const EdgeSides edges = groupSides(mesh);
  std::vector<std::int32_t> regionOf;
  std::vector<Region> regions = findRegions(mesh, edges, supported, regionOf);
  std::vector<std::uint8_t> keep(supported);
  if (options.trimming == Trimming::holes) {
    measureReach(mesh, regionOf, search, regions, execution);
    const double maxHole = resolvedMaxHole(options, diagonal);
    for (std::size_t t = 0; t < keep.size(); ++t)
      if (regionOf[t] != noRegion) {
        const Region& region = regions[at(regionOf[t])];
        keep[t] = region.mayBeHole() && region.diameter() <= maxHole ? 1 : 0;
      }
  }
  result.componentsDropped = dropSmallComponents(mesh, edges, supported, options.minComponentShare, keep);

  // A region is kept or dropped as a whole.
  std::vector<std::uint8_t> isKept(regions.size(), 0);
  for (std::size_t t = 0; t < keep.size(); ++t) {
    if (!keep[t])
      result.areaDropped += areaOf(mesh, t);
    if (regionOf[t] != noRegion)
      isKept[at(regionOf[t])] = keep[t];
  }
  for (std::size_t r = 0; r < regions.size(); ++r) {
    if (!isKept[r]) {
      ++result.extrapolationsDropped;
      continue;
    }
    ++result.holesFilled;
    result.areaFilled += regions[r].area;
    result.largestHole = std::max(result.largestHole, regions[r].diameter());
  }
  result.mesh = select(mesh, keep);
  splitFans(result.mesh);
  return result;
}

} // namespace mrf
} // namespace pcl

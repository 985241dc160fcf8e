// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/passes.h"

#include "base/loops.h"
#include "base/spatial_sort.h"
#include "remesher/regions.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

constexpr std::int64_t edgeGrain = 16384;

/// Half-edges that fulfill a condition, ascending.
template <typename Condition>
std::vector<std::int32_t> halfEdgesWhere(const RemeshedSurface& surface, const Condition& holds, Execution& execution)
{
  return joined(partsOf<std::vector<std::int32_t>, std::int32_t>(
      execution, surface.mesh.halfEdgeCount(), edgeGrain,
      [&](std::vector<std::int32_t>& found, std::int32_t begin, std::int32_t end) {
        for (std::int32_t h = begin; h < end; ++h)
          if (holds(surface, h))
            found.push_back(h);
      }));
}

/// The middle of an edge, or of a border edge's piece of the curve, moved to the surface; nothing if that is too far.
std::optional<Site> middleOf(const RemeshedSurface& surface, std::int32_t h)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  const std::int32_t a = mesh.origin[h], b = mesh.target(h);
  double place = -1;
  Vector3f middle = .5f * (mesh.positions[a] + mesh.positions[b]);
  if (mesh.twin[h] < 0) {
    place = surface.curves.between(mesh.places[a], mesh.places[b], .5);
    middle = surface.curves.at(place);
  }
  const std::optional<Corner> reached = surface.level.trace(middle);
  return reached ? std::optional<Site>({*reached, place}) : std::nullopt;
}

bool isLong(const RemeshedSurface& surface, std::int32_t h)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  return mesh.represents(h) && surface.squaredLength(h) > squared(4 * surface.targetOf(h) / 3) &&
         !(mesh.pinned[mesh.origin[h]] && mesh.pinned[mesh.target(h)]);
}

bool split(RemeshedSurface& surface, std::int32_t h, const HalfEdgeMesh::Room& room, OperationLog& log)
{
  HalfEdgeMesh& mesh = surface.mesh;
  const std::int32_t g = mesh.twin[h];
  const std::optional<Site> middle = middleOf(surface, h);
  if (!middle)
    return false;
  const Corner a = surface.corner(mesh.origin[h]), b = surface.corner(mesh.target(h)), m = middle->corner;
  const auto halvesFit = [&](std::int32_t side, const Corner& from, const Corner& to) {
    const Corner apex = surface.corner(mesh.opposite(side));
    TriangleShape former = surface.shape(side);
    former.shape *= .5f; // halves of a needle are thinner, but only splits remove needles
    return surface.mayReplace(former, {from, m, apex}) && surface.mayReplace(former, {m, to, apex});
  };
  if (!halvesFit(h, a, b) || (g >= 0 && !halvesFit(g, b, a)))
    return false;
  log.addSplit(mesh, h, room);
  surface.moveTo(mesh.split(h, room, m.position, m.normal), *middle);
  return true;
}

bool isShort(const RemeshedSurface& surface, std::int32_t h)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  return mesh.represents(h) && surface.squaredLength(h) < squared(4 * surface.targetOf(h) / 5) &&
         !mesh.pinned[mesh.origin[h]] && !mesh.pinned[mesh.target(h)];
}

std::uint64_t keyOf(const RemeshedSurface& surface, std::int32_t h)
{
  int exponent;
  std::frexp(surface.squaredLength(h) / squared(surface.targetOf(h)), &exponent);
  return static_cast<std::uint64_t>(exponent + 1024) << 32 | static_cast<std::uint32_t>(h);
}

/// True if no edge from the merged vertex to a neighbor of the two ends gets too long.
bool edgesFit(const RemeshedSurface& surface, std::int32_t h, const Vector3f& merged)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  bool fits = true;
  for (const std::int32_t end : {mesh.origin[h], mesh.target(h)})
    mesh.forNeighbors(end, [&](std::int32_t w) {
      const float longest = squared(4 * surface.targetBetween(end, w) / 3);
      // An edge that is too long already must not prevent the collapse of a needle's short edge.
      const float former = 1.21f * (mesh.positions[w] - mesh.positions[end]).squaredNorm();
      fits = fits && (mesh.positions[w] - merged).squaredNorm() <= std::max(longest, former);
    });
  return fits;
}

/// True if merging the ends of an edge spoils none of their triangles.
bool trianglesFit(const RemeshedSurface& surface, std::int32_t h, const Corner& merged)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  const std::int32_t g = mesh.twin[h];
  bool fits = true;
  for (const std::int32_t end : {mesh.origin[h], mesh.target(h)})
    mesh.forOutgoing(end, [&](std::int32_t spoke) {
      if (!fits || spoke / 3 == h / 3 || (g >= 0 && spoke / 3 == g / 3))
        return;
      const TriangleShape next(merged, surface.corner(mesh.target(spoke)), surface.corner(mesh.opposite(spoke)));
      if (surface.isFineFor(spoke, next))
        return;
      TriangleShape former = surface.shape(spoke);
      // With three needles around a tiny triangle the first collapse thins two of them; the next one removes them.
      if (former.isSliver())
        former.shape *= .5f;
      fits = surface.mayReplace(former, next);
    });
  return fits;
}

bool mergeAt(RemeshedSurface& surface, std::int32_t h, const Site& site, OperationLog& log)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  if (mesh.twin[h] < 0 &&
      !surface.followsBorder(mesh.previousOnBorder(mesh.origin[h]), site, mesh.nextOnBorder(mesh.target(h))))
    return false;
  if (!edgesFit(surface, h, site.corner.position) || !trianglesFit(surface, h, site.corner))
    return false;
  surface.merge(h, site, log);
  return true;
}

/// Merges the ends of an edge at its middle, else at one of them; at the end on the border, if only one is there.
bool collapse(RemeshedSurface& surface, std::int32_t edge, OperationLog& log)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  const std::int32_t h = surface.towardsWhatGoes(edge);
  const std::int32_t a = mesh.origin[h], b = mesh.target(h);
  if (!mesh.mayCollapse(h))
    return false;
  if (mesh.twin[h] >= 0 && mesh.onBoundary(a))
    return mergeAt(surface, h, surface.site(a), log);
  // If the middle does not fit before it is moved to the surface, it hardly will after that.
  const bool mayFit = edgesFit(surface, h, .5f * (mesh.positions[a] + mesh.positions[b]));
  const std::optional<Site> middle = mayFit ? middleOf(surface, h) : std::nullopt;
  return (middle && mergeAt(surface, h, *middle, log)) || mergeAt(surface, h, surface.site(a), log) ||
         mergeAt(surface, h, surface.site(b), log);
}

/// Growth of the squared deviation from the ideal valence if the valence changes. \param change 1 or −1
int growth(const HalfEdgeMesh& mesh, std::int32_t vertex, int change)
{
  const int deviation = mesh.valence[vertex] - (mesh.onBoundary(vertex) ? 4 : 6);
  return 2 * change * deviation + 1;
}

bool isToFlip(const RemeshedSurface& surface, std::int32_t h)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  if (!mesh.represents(h) || mesh.twin[h] < 0)
    return false;
  const std::int32_t a = mesh.origin[h], b = mesh.target(h), c = mesh.opposite(h), d = mesh.opposite(mesh.twin[h]);
  if ((mesh.pinned[a] && mesh.pinned[b]) || (mesh.pinned[c] && mesh.pinned[d]))
    return false;
  return growth(mesh, a, -1) + growth(mesh, b, -1) + growth(mesh, c, 1) + growth(mesh, d, 1) < 0;
}

bool flip(RemeshedSurface& surface, std::int32_t h, OperationLog& log)
{
  HalfEdgeMesh& mesh = surface.mesh;
  const std::int32_t g = mesh.twin[h];
  const std::int32_t a = mesh.origin[h], b = mesh.origin[g], c = mesh.opposite(h), d = mesh.opposite(g);
  const int minA = mesh.onBoundary(a) ? 2 : 3, minB = mesh.onBoundary(b) ? 2 : 3;
  if (mesh.valence[a] <= minA || mesh.valence[b] <= minB || mesh.adjacent(c, d))
    return false;
  const TriangleShape former = surface.shape(h) & surface.shape(g);
  const Corner cornerC = surface.corner(c), cornerD = surface.corner(d);
  if (!surface.mayReplace(former, {surface.corner(a), cornerD, cornerC}) ||
      !surface.mayReplace(former, {cornerD, surface.corner(b), cornerC}))
    return false;
  log.addFlip(mesh, h);
  mesh.flip(h);
  return true;
}

using IsWanted = bool(const RemeshedSurface&, std::int32_t h);

/// Does an operation on half-edges, region by region, if it is still wanted after the operations before.
/// \param done the number of operations that were not refused is added to it
/// \param operation takes a half-edge, its place in the list and a log, returns false if it is refused
template <typename Operation>
void operate(RemeshedSurface& surface, const std::vector<std::int32_t>& halfEdges, IsWanted& isWanted,
             std::int64_t& done, Execution& execution, const Operation& operation)
{
  struct Own {
    std::int64_t done = 0, refused = 0;
    OperationLog log;
  };
  const HalfEdgeMesh& mesh = surface.mesh;
  const auto turnOf = [&](std::int32_t n, std::uint16_t region) {
    const std::int32_t h = halfEdges[n];
    if (!mesh.isBetween(h, region))
      return Turn::later;
    if (!isWanted(surface, h))
      return Turn::never;
    return mesh.isAmid(h, region) ? Turn::now : Turn::later;
  };
  const auto work = [&](std::int32_t n, Own& own) {
    if (isWanted(surface, halfEdges[n]))
      ++(operation(halfEdges[n], n, own.log) ? own.done : own.refused);
  };
  std::vector<Own> owns = workByRegion<Own>(
      static_cast<std::int32_t>(halfEdges.size()),
      [&](std::int32_t n) { return mesh.regions[mesh.origin[halfEdges[n]]]; }, turnOf, work, execution);
  for (Own& own : owns) {
    done += own.done;
    surface.result.refusedOperations += own.refused;
    own.log.shrink();
    surface.logs.push_back(std::move(own.log));
  }
}

} // namespace

void splitLongEdges(RemeshedSurface& surface, Execution& execution)
{
  const std::vector<std::int32_t> halfEdges = halfEdgesWhere(surface, isLong, execution);
  const HalfEdgeMesh::Room room = surface.mesh.makeRoom(static_cast<std::int32_t>(halfEdges.size()));
  operate(surface, halfEdges, isLong, surface.result.splits, execution,
          [&](std::int32_t h, std::int32_t n, OperationLog& log) { return split(surface, h, room[n], log); });
}

void collapseShortEdges(RemeshedSurface& surface, Execution& execution)
{
  std::vector<std::int32_t> halfEdges = halfEdgesWhere(surface, isShort, execution);
  std::vector<std::uint64_t> keys;
  keys.reserve(halfEdges.size());
  for (const std::int32_t h : halfEdges)
    keys.push_back(keyOf(surface, h));
  sortByUpperHalf(keys, execution);
  std::transform(keys.begin(), keys.end(), halfEdges.begin(),
                 [](std::uint64_t key) { return static_cast<std::int32_t>(key & 0xffffffff); });
  operate(surface, halfEdges, isShort, surface.result.collapses, execution,
          [&](std::int32_t h, std::int32_t, OperationLog& log) { return collapse(surface, h, log); });
}

void flipEdges(RemeshedSurface& surface, Execution& execution)
{
  operate(surface, halfEdgesWhere(surface, isToFlip, execution), isToFlip, surface.result.flips, execution,
          [&](std::int32_t h, std::int32_t, OperationLog& log) { return flip(surface, h, log); });
}

} // namespace pcl::mrf

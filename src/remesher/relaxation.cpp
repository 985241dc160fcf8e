// SPDX-License-Identifier: BSD-3-Clause
#include "base/loops.h"
#include "remesher/passes.h"
#include "remesher/regions.h"

#include <cstdint>
#include <numeric>
#include <optional>
#include <vector>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

/// Min length of a step, as a share of the target edge. Shorter ones change angles by about a degree.
constexpr float minStep = .02f;
constexpr std::int64_t stepGrain = 2048;

struct Step {
  Vector3f tangential = Vector3f::Zero();
  std::optional<Corner> reached; ///< by the whole step, then to the zero level; not used on the border
  bool isSettled = false;        ///< the step is too short to be taken
};

/// Twice the area of each vertex's triangles, over its squared sizing.
std::vector<float> relativeAreas(const RemeshedSurface& surface, Execution& execution)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  std::vector<float> areas(mesh.positions.size(), 0);
  forEachPolling<std::int32_t>(execution, mesh.vertexCount(), stepGrain, [&](std::int32_t v) {
    if (mesh.outgoing[v] < 0)
      return;
    mesh.forOutgoing(v, [&](std::int32_t h) { areas[v] += surface.cross(h).norm(); });
    areas[v] /= squared(mesh.sizing[v]);
  });
  return areas;
}

std::vector<Step> stepsOf(const RemeshedSurface& surface, Execution& execution)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  std::vector<Step> steps(mesh.positions.size());
  const std::vector<float> areas = relativeAreas(surface, execution);
  forEachPolling<std::int32_t>(execution, mesh.vertexCount(), stepGrain, [&](std::int32_t v) {
    if (mesh.outgoing[v] < 0 || mesh.pinned[v] || mesh.onBoundary(v))
      return;
    Vector3f sum = Vector3f::Zero();
    float weight = 0;
    const Vector3f p = mesh.positions[v], n = mesh.normals[v];
    mesh.forNeighbors(v, [&](std::int32_t w) {
      sum += areas[w] * (mesh.positions[w] - p);
      weight += areas[w];
    });
    const Vector3f towards = weight > 0 ? Vector3f(sum / weight) : Vector3f::Zero();
    Step& step = steps[v];
    step.tangential = towards - n * n.dot(towards);
    step.isSettled = step.tangential.squaredNorm() < squared(minStep * surface.targetAt(v));
    if (!step.isSettled)
      step.reached = surface.level.trace(p + step.tangential);
  });
  return steps;
}

std::optional<Site> siteInside(const RemeshedSurface& surface, std::int32_t v, const Step& step, float share)
{
  const std::optional<Corner> moved =
      share < 1 ? surface.level.trace(surface.mesh.positions[v] + share * step.tangential) : step.reached;
  return moved ? std::optional<Site>({*moved}) : std::nullopt;
}

/// A share of the way toward the middle of a vertex's neighbors along the border's curve.
std::optional<Site> siteAlongBorder(const RemeshedSurface& surface, std::int32_t v, float share)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  const BorderCurves& curves = surface.curves;
  const std::int32_t previous = mesh.previousOnBorder(v), next = mesh.nextOnBorder(v);
  const double start = mesh.places[previous], end = mesh.places[next];
  const double own = curves.share(start, mesh.places[v], end);
  const double place = curves.between(start, end, own + static_cast<double>(share) * (.5 - own));
  const Vector3f& p = mesh.positions[v];
  const std::optional<Corner> moved = surface.level.trace(p + share * (curves.at(place) - p));
  if (!moved || !surface.followsBorder(previous, {*moved, place}, next))
    return {};
  return Site{*moved, place};
}

/// Takes the largest share of the vertex's step that fits. \return false if no tangential one did
bool move(RemeshedSurface& surface, std::int32_t v, const Step& step)
{
  for (const float share : {1.0f, .5f, .25f, 0.0f}) { // 0: to the zero level only
    const std::optional<Site> site =
        surface.mesh.onBoundary(v) ? siteAlongBorder(surface, v, share) : siteInside(surface, v, step, share);
    if (site && surface.mayMove(v, site->corner)) {
      surface.moveTo(v, *site);
      return share > 0;
    }
  }
  return false;
}

} // namespace

void relax(RemeshedSurface& surface, Execution& execution)
{
  const HalfEdgeMesh& mesh = surface.mesh;
  const std::vector<Step> steps = stepsOf(surface, execution);
  std::vector<std::int32_t> vertices;
  for (std::int32_t v = 0; v < mesh.vertexCount(); ++v)
    if (mesh.outgoing[v] >= 0 && !mesh.pinned[v] && !steps[v].isSettled)
      vertices.push_back(v);
  const auto turnOf = [&](std::int32_t n, std::uint16_t region) {
    bool isInside = true;
    mesh.forNeighbors(vertices[n], [&](std::int32_t w) { isInside = isInside && mesh.regions[w] == region; });
    return isInside ? Turn::now : Turn::later;
  };
  const auto refused = workByRegion<std::int64_t>(
      static_cast<std::int32_t>(vertices.size()), [&](std::int32_t n) { return mesh.regions[vertices[n]]; }, turnOf,
      [&](std::int32_t n, std::int64_t& own) { own += !move(surface, vertices[n], steps[vertices[n]]); }, execution);
  surface.result.refusedOperations += std::accumulate(refused.begin(), refused.end(), std::int64_t{0});
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "base/loops.h"
#include "remesher/passes.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <optional>
#include <thread>
#include <vector>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

/// Share of the target edge below which a step is not worth the way: it changes angles by about a degree.
constexpr float minStep = .02f;
constexpr std::int64_t stepGrain = 2048;

struct Step {
  Vector3f tangential = Vector3f::Zero();
  std::optional<Corner> reached; ///< by the whole step, then to the zero level; on the border not in use
  bool isSettled = false;        ///< the step is not worth the way
};

/// Twice those of the triangles of each vertex, beside what its sizing asks for.
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

/// Towards the middle between its neighbors along the border's curve.
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

/// Takes what fits of the vertex's step. \return false if nothing tangential did
bool move(RemeshedSurface& surface, std::int32_t v, const Step& step)
{
  for (const float share : {1.0f, .5f, .25f, 0.0f}) { // the last: to the zero level and no more
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
  std::vector<std::vector<std::int32_t>> listed; // those to move of each region
  for (std::int32_t v = 0; v < mesh.vertexCount(); ++v)
    if (mesh.outgoing[v] >= 0 && !mesh.pinned[v] && !steps[v].isSettled) {
      listed.resize(std::max(listed.size(), std::size_t{mesh.regions[v]} + 1));
      listed[mesh.regions[v]].push_back(v);
    }
  std::vector<std::uint8_t> isWaiting(steps.size(), 0);
  std::vector<std::int64_t> refused(listed.size() + 1, 0);
  Poller poll(execution);
  const std::thread::id caller = std::this_thread::get_id();
  forEach(execution, static_cast<std::int64_t>(listed.size()), 1, [&](std::size_t region) {
    const bool mayPoll = std::this_thread::get_id() == caller;
    for (const std::int32_t v : listed[region]) {
      if (mayPoll)
        poll();
      bool isInside = true;
      mesh.forNeighbors(v, [&](std::int32_t w) { isInside = isInside && mesh.regions[w] == region; });
      if (!isInside)
        isWaiting[v] = 1;
      else if (!move(surface, v, steps[v]))
        ++refused[region];
    }
  });
  for (std::int32_t v = 0; v < mesh.vertexCount(); ++v) {
    poll();
    if (isWaiting[v] && !move(surface, v, steps[v]))
      ++refused.back();
  }
  surface.result.refusedOperations += std::accumulate(refused.begin(), refused.end(), std::int64_t{0});
}

} // namespace pcl::mrf

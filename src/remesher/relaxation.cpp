// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/relaxation.h"

#include "base/loops.h"

#include <numeric>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

/// Share of the target edge below which a step is not worth the way: it changes angles by about a degree.
constexpr float minStep = .02f;
constexpr std::int64_t stepGrain = 2048;

} // namespace

Relaxation::Relaxation(RemeshedSurface& surface, Execution& execution)
    : surface_(surface), execution_(execution), steps_(surface.mesh.positions.size()),
      isWaiting_(surface.mesh.positions.size(), 0)
{}

void Relaxation::moveAll()
{
  computeSteps();
  moveInRanges();
  moveWaiting();
}

/// Twice those of the triangles of each vertex, beside what its sizing asks for.
std::vector<float> Relaxation::relativeAreas() const
{
  const HalfEdgeMesh& mesh = surface_.mesh;
  std::vector<float> areas(mesh.positions.size(), 0);
  forEachPolling<std::int32_t>(execution_, mesh.vertexCount(), stepGrain, [&](std::int32_t v) {
    mesh.forOutgoing(v, [&](std::int32_t h) { areas[v] += surface_.cross(h).norm(); });
    areas[v] /= squared(mesh.sizing[v]);
  });
  return areas;
}

void Relaxation::computeSteps()
{
  const HalfEdgeMesh& mesh = surface_.mesh;
  const std::vector<float> areas = relativeAreas();
  forEachPolling<std::int32_t>(execution_, mesh.vertexCount(), stepGrain, [&](std::int32_t v) {
    if (mesh.pinned[v] || mesh.onBoundary(v))
      return;
    Vector3f sum = Vector3f::Zero();
    float weight = 0;
    const Vector3f p = mesh.positions[v], n = mesh.normals[v];
    mesh.forNeighbors(v, [&](std::int32_t w) {
      sum += areas[w] * (mesh.positions[w] - p);
      weight += areas[w];
    });
    const Vector3f towards = weight > 0 ? Vector3f(sum / weight) : Vector3f::Zero();
    Step& step = steps_[v];
    step.tangential = towards - n * n.dot(towards);
    step.isSettled = step.tangential.squaredNorm() < squared(minStep * surface_.targetAt(v));
    if (!step.isSettled)
      step.reached = surface_.level.trace(p + step.tangential);
  });
}

void Relaxation::moveInRanges()
{
  const HalfEdgeMesh& mesh = surface_.mesh;
  const auto refusals = partsOf<std::int64_t, std::int32_t>(
      execution_, mesh.vertexCount(), HalfEdgeMesh::regionSize(mesh.vertexCount()),
      [&](std::int64_t& refused, std::int32_t begin, std::int32_t end) {
        for (std::int32_t v = begin; v < end; ++v) {
          if (mesh.pinned[v] || steps_[v].isSettled)
            continue;
          bool isInside = true;
          mesh.forNeighbors(v, [&](std::int32_t w) { isInside = isInside && w >= begin && w < end; });
          if (!isInside)
            isWaiting_[v] = 1;
          else if (!move(v))
            ++refused;
        }
      });
  surface_.result.refusedOperations += std::accumulate(refusals.begin(), refusals.end(), std::int64_t{0});
}

void Relaxation::moveWaiting()
{
  Poller poll(execution_);
  for (std::int32_t v = 0; v < surface_.mesh.vertexCount(); ++v) {
    poll();
    if (isWaiting_[v] && !move(v))
      ++surface_.result.refusedOperations;
  }
}

/// Takes what fits of the vertex's step. \return false if nothing tangential did
bool Relaxation::move(std::int32_t v)
{
  return surface_.mesh.onBoundary(v) ? moveAlongBorder(v) : moveInside(v);
}

bool Relaxation::moveInside(std::int32_t v)
{
  const Step& step = steps_[v];
  return moveByShare(v, [&](float share) -> std::optional<Site> {
    const std::optional<Corner> moved =
        share < 1 ? surface_.level.trace(surface_.mesh.positions[v] + share * step.tangential) : step.reached;
    return moved ? std::optional<Site>({*moved}) : std::nullopt;
  });
}

/// Towards the middle between its neighbors along the border's curve.
bool Relaxation::moveAlongBorder(std::int32_t v)
{
  const HalfEdgeMesh& mesh = surface_.mesh;
  const BorderCurves& curves = surface_.curves;
  const std::int32_t previous = mesh.previousOnBorder(v), next = mesh.nextOnBorder(v);
  const double start = mesh.places[previous], end = mesh.places[next];
  const double own = curves.share(start, mesh.places[v], end);
  return moveByShare(v, [&](float share) -> std::optional<Site> {
    const double place = curves.between(start, end, own + static_cast<double>(share) * (.5 - own));
    const Vector3f& p = mesh.positions[v];
    const std::optional<Corner> moved = surface_.level.trace(p + share * (curves.at(place) - p));
    if (!moved || !surface_.followsBorder(previous, {*moved, place}, next))
      return {};
    return Site{*moved, place};
  });
}

/// \param propose gives the site for a share of the step, if there is one
template <typename Propose>
bool Relaxation::moveByShare(std::int32_t v, const Propose& propose)
{
  for (const float share : {1.0f, .5f, .25f, 0.0f}) { // the last: to the zero level and no more
    const std::optional<Site> site = propose(share);
    if (site && surface_.mayMove(v, site->corner)) {
      surface_.moveTo(v, *site);
      return share > 0;
    }
  }
  return false;
}

} // namespace pcl::mrf

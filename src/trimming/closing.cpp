// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/closing.h"

#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace pcl::mrf {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

/// Calls visit(to) for each neighbor of a vertex in a sheet, mostly twice.
template <typename Visit>
void forNeighbors(const TriangleMesh& mesh, const VertexCorners& sheet, std::int32_t vertex, const Visit& visit)
{
  for (std::int32_t c = sheet.begin[vertex]; c < sheet.begin[vertex + 1]; ++c) {
    const std::int32_t corner = sheet.corners[c];
    const Triangle& t = mesh.triangles[corner / 3];
    visit(t[(corner + 1) % 3]);
    visit(t[(corner + 2) % 3]);
  }
}

/// A front that runs along edges from its seeds up to a radius. Distances are in units of the radius.
class Front {
public:
  Front(const TriangleMesh& mesh, const VertexCorners& sheet, float radius)
      : mesh_(mesh), sheet_(sheet), radius_(radius), distances_(mesh.vertices.size(), infinity)
  {}

  /// 0..1; infinite where the front has not come.
  float distance(std::int32_t vertex) const { return distances_[vertex]; }
  bool hasReached(std::int32_t vertex) const { return distances_[vertex] < infinity; }

  void reach(std::int32_t vertex, float distance)
  {
    if (!(distance <= 1) || !(distance < distances_[vertex]))
      return;
    distances_[vertex] = distance;
    queue_.push({distance, vertex});
  }

  /// Advances to vertices v with mayReach(v) until none is left.
  template <typename MayReach>
  void run(const MayReach& mayReach)
  {
    while (!queue_.empty()) {
      const auto [distance, from] = queue_.top();
      queue_.pop();
      if (distance > distances_[from])
        continue;
      forNeighbors(mesh_, sheet_, from, [&, distance = distance, from = from](std::int32_t to) {
        if (distances_[to] > distance && mayReach(to))
          reach(to, distance + (mesh_.vertices[from] - mesh_.vertices[to]).norm() / radius_);
      });
    }
  }

private:
  using Entry = std::pair<float, std::int32_t>;
  const TriangleMesh& mesh_;
  const VertexCorners& sheet_;
  float radius_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> queue_; ///< by distance
  std::vector<float> distances_;
};

} // namespace

std::vector<std::uint8_t> close(const TriangleMesh& mesh, const VertexCorners& sheet, const std::vector<RimVertex>& rim,
                                float radius, const std::vector<std::uint8_t>& isOnBoundary)
{
  const auto vertices = static_cast<std::int32_t>(mesh.vertices.size());
  Front dilation(mesh, sheet, radius);
  for (const RimVertex& seed : rim)
    dilation.reach(seed.vertex, seed.distance / radius);
  dilation.run([](std::int32_t) { return true; });

  // The outside begins where the dilated surface ends. Beyond the mesh's boundary it begins where that would end.
  Front erosion(mesh, sheet, radius);
  for (std::int32_t v = 0; v < vertices; ++v)
    if (dilation.hasReached(v)) {
      if (isOnBoundary[v])
        erosion.reach(v, 1 - dilation.distance(v));
    } else {
      forNeighbors(mesh, sheet, v, [&](std::int32_t to) {
        if (dilation.hasReached(to))
          erosion.reach(v, 0);
      });
    }
  erosion.run([&](std::int32_t v) { return dilation.hasReached(v); });

  std::vector<std::uint8_t> isFilled(mesh.vertices.size(), 0);
  for (std::int32_t v = 0; v < vertices; ++v)
    isFilled[v] = dilation.hasReached(v) && !erosion.hasReached(v) ? 1 : 0;
  return isFilled;
}

} // namespace pcl::mrf

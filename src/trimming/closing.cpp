// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/closing.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

namespace pcl {
namespace mrf {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

/// Calls visit(neighbor) for the ends of all edges of a vertex; inner edges come twice.
template <typename Visit>
void forNeighbors(const TriangleMesh& mesh, const VertexCorners& corners, std::int32_t vertex, const Visit& visit)
{
  for (std::int32_t c = corners.begin[vertex]; c < corners.begin[vertex + 1]; ++c) {
    const std::int32_t corner = corners.corners[c];
    const Triangle& t = mesh.triangles[corner / 3];
    visit(t[(corner + 1) % 3]);
    visit(t[(corner + 2) % 3]);
  }
}

/// A front that runs along edges from its seeds. Distances are in radii.
class Front {
public:
  explicit Front(std::size_t vertices) : distances_(vertices, infinity) {}

  /// 0..1; infinite where it has not come.
  float distance(std::int32_t vertex) const { return distances_[vertex]; }
  bool hasReached(std::int32_t vertex) const { return distances_[vertex] < infinity; }

  bool reach(std::int32_t vertex, float distance)
  {
    if (!(distance <= 1) || !(distance < distances_[vertex]))
      return false;
    distances_[vertex] = distance;
    queue_.push({distance, vertex});
    return true;
  }

  /// Goes on until nothing is left within a radius; `step(from, to)` is the length of an edge in radii, and
  /// `arrive(from, to)` is called whenever a vertex is reached on a shorter way.
  template <typename Step, typename Arrive>
  void run(const TriangleMesh& mesh, const VertexCorners& corners, const Step& step, const Arrive& arrive)
  {
    while (!queue_.empty()) {
      const Entry entry = queue_.top();
      queue_.pop();
      const std::int32_t from = entry.second;
      if (entry.first > distances_[from])
        continue;
      forNeighbors(mesh, corners, from, [&](std::int32_t to) {
        if (distances_[to] > entry.first && reach(to, entry.first + step(from, to)))
          arrive(from, to);
      });
    }
  }

private:
  // Of equal distances the smaller vertex first: the order depends on nothing else.
  using Entry = std::pair<float, std::int32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> queue_;
  std::vector<float> distances_;
};

} // namespace

std::vector<std::uint8_t> close(const TriangleMesh& mesh, const VertexCorners& sheet, const std::vector<RimVertex>& rim,
                                const std::vector<std::uint8_t>& isOnBoundary)
{
  const auto length = [&](std::int32_t a, std::int32_t b) { return (mesh.vertices[a] - mesh.vertices[b]).norm(); };
  std::vector<float> radii(mesh.vertices.size(), 0);
  const auto vertices = static_cast<std::int32_t>(mesh.vertices.size());
  Front dilation(mesh.vertices.size());
  for (const RimVertex& seed : rim)
    if (dilation.reach(seed.vertex, seed.distance / seed.radius))
      radii[seed.vertex] = seed.radius;
  dilation.run(
      mesh, sheet, [&](std::int32_t from, std::int32_t to) { return length(from, to) / radii[from]; },
      [&](std::int32_t from, std::int32_t to) { radii[to] = radii[from]; });

  // The outside begins where the dilated surface ends, and as far beyond the mesh's boundary as that would have gone.
  Front erosion(mesh.vertices.size());
  for (std::int32_t v = 0; v < vertices; ++v)
    if (dilation.hasReached(v)) {
      if (isOnBoundary[v])
        erosion.reach(v, 1 - dilation.distance(v));
    } else {
      bool isNext = false;
      forNeighbors(mesh, sheet, v, [&](std::int32_t w) { isNext = isNext || dilation.hasReached(w); });
      if (isNext)
        erosion.reach(v, 0);
    }
  erosion.run(
      mesh, sheet,
      [&](std::int32_t from, std::int32_t to) { return length(from, to) / std::max(radii[from], radii[to]); },
      [](std::int32_t, std::int32_t) {});

  std::vector<std::uint8_t> isFilled(mesh.vertices.size(), 0);
  for (std::int32_t v = 0; v < vertices; ++v)
    isFilled[v] = dilation.hasReached(v) && !erosion.hasReached(v) ? 1 : 0;
  return isFilled;
}

} // namespace mrf
} // namespace pcl

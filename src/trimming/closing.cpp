// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/closing.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

namespace pcl::mrf {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

/// The edges of a sheet, by vertex, side by side in memory: fronts run over them several times.
class SheetEdges {
public:
  struct Edge {
    std::int32_t to;
    float length;
  };

  SheetEdges(const TriangleMesh& mesh, const VertexCorners& sheet) : begin_(mesh.vertices.size() + 1, 0)
  {
    edges_.reserve(sheet.corners.size() + mesh.vertices.size()); // a fan with an end has one edge more than corners
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      for (std::int32_t c = sheet.begin[v]; c < sheet.begin[v + 1]; ++c) {
        const std::int32_t corner = sheet.corners[c];
        const Triangle& t = mesh.triangles[corner / 3];
        add(mesh, v, t[(corner + 1) % 3]);
        add(mesh, v, t[(corner + 2) % 3]);
      }
      begin_[v + 1] = edges_.size();
    }
  }

  const Edge* begin(std::int32_t vertex) const { return edges_.data() + begin_[vertex]; }
  const Edge* end(std::int32_t vertex) const { return edges_.data() + begin_[vertex + 1]; }

private:
  void add(const TriangleMesh& mesh, std::size_t from, std::int32_t to)
  {
    const auto isSame = [to](const Edge& edge) { return edge.to == to; };
    if (std::none_of(edges_.begin() + static_cast<std::ptrdiff_t>(begin_[from]), edges_.end(), isSame))
      edges_.push_back({to, (mesh.vertices[from] - mesh.vertices[to]).norm()});
  }

  std::vector<std::size_t> begin_;
  std::vector<Edge> edges_;
};

/// A front that runs along edges from its seeds. Distances are in radii.
class Front {
public:
  explicit Front(std::size_t vertices) : queue_(binsPerRadius + 1), distances_(vertices, infinity) {}

  /// 0..1; infinite where it has not come.
  float distance(std::int32_t vertex) const { return distances_[vertex]; }
  bool hasReached(std::int32_t vertex) const { return distances_[vertex] < infinity; }

  bool reach(std::int32_t vertex, float distance)
  {
    if (!(distance <= 1) || !(distance < distances_[vertex]))
      return false;
    distances_[vertex] = distance;
    const auto bin = static_cast<std::size_t>(distance * binsPerRadius);
    queue_[bin].push_back({distance, vertex});
    if (bin == bin_)
      std::push_heap(queue_[bin].begin(), queue_[bin].end(), std::greater<>());
    return true;
  }

  /// Goes on until nothing is left within a radius; `radius(from, to)` is that of an edge, and
  /// `arrive(from, to)` is called whenever a vertex is reached on a shorter way.
  template <typename Radius, typename Arrive>
  void run(const SheetEdges& edges, const Radius& radius, const Arrive& arrive)
  {
    for (bin_ = 0; bin_ < queue_.size(); ++bin_) {
      std::vector<Entry>& nearest = queue_[bin_];
      std::make_heap(nearest.begin(), nearest.end(), std::greater<>());
      while (!nearest.empty()) {
        std::pop_heap(nearest.begin(), nearest.end(), std::greater<>());
        const auto [distance, from] = nearest.back();
        nearest.pop_back();
        if (distance > distances_[from])
          continue;
        for (const SheetEdges::Edge* edge = edges.begin(from); edge < edges.end(from); ++edge)
          if (distances_[edge->to] > distance && reach(edge->to, distance + edge->length / radius(from, edge->to)))
            arrive(from, edge->to);
      }
      nearest = std::vector<Entry>();
    }
  }

private:
  // Of equal distances the smaller vertex first: the order depends on nothing else.
  using Entry = std::pair<float, std::int32_t>;
  static constexpr int binsPerRadius = 1024;
  std::vector<std::vector<Entry>> queue_; ///< by distance; only the bin that the front is in is sorted, as a heap
  std::size_t bin_ = binsPerRadius + 1;   ///< where the front is
  std::vector<float> distances_;
};

} // namespace

std::vector<std::uint8_t> close(const TriangleMesh& mesh, const VertexCorners& sheet, const std::vector<RimVertex>& rim,
                                const std::vector<std::uint8_t>& isOnBoundary)
{
  const SheetEdges edges(mesh, sheet);
  std::vector<float> radii(mesh.vertices.size(), 0);
  const auto vertices = static_cast<std::int32_t>(mesh.vertices.size());
  Front dilation(mesh.vertices.size());
  for (const RimVertex& seed : rim)
    if (dilation.reach(seed.vertex, seed.distance / seed.radius))
      radii[seed.vertex] = seed.radius;
  dilation.run(
      edges, [&](std::int32_t from, std::int32_t) { return radii[from]; },
      [&](std::int32_t from, std::int32_t to) { radii[to] = radii[from]; });

  // The outside begins where the dilated surface ends, and as far beyond the mesh's boundary as that would have gone.
  Front erosion(mesh.vertices.size());
  for (std::int32_t v = 0; v < vertices; ++v)
    if (dilation.hasReached(v)) {
      if (isOnBoundary[v])
        erosion.reach(v, 1 - dilation.distance(v));
    } else {
      if (std::any_of(edges.begin(v), edges.end(v), [&](const auto& edge) { return dilation.hasReached(edge.to); }))
        erosion.reach(v, 0);
    }
  erosion.run(
      edges, [&](std::int32_t from, std::int32_t to) { return std::max(radii[from], radii[to]); },
      [](std::int32_t, std::int32_t) {});

  std::vector<std::uint8_t> isFilled(mesh.vertices.size(), 0);
  for (std::int32_t v = 0; v < vertices; ++v)
    isFilled[v] = dilation.hasReached(v) && !erosion.hasReached(v) ? 1 : 0;
  return isFilled;
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/orientation_graph.h"

#include "base/loops.h"
#include "base/spatial_sort.h"

#include <pcl/surface/mrf/exceptions.h>

#include <array>
#include <cmath>
#include <cstring>
#include <string>

namespace pcl::mrf {
namespace {

/// Points per piece of parallel work.
constexpr std::int64_t graphGrain = 4096;

/// Bits of a float; those of floats that are not negative are ordered like the floats.
std::uint32_t bitsOf(float value)
{
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

} // namespace

std::uint64_t edge_key::of(float quality, std::size_t place)
{
  return std::uint64_t{bitsOf(1 - quality)} << placeBits | place;
}

std::uint32_t SignedForest::root(std::uint32_t i)
{
  std::uint32_t top = i;
  std::uint8_t flip = 0;
  while (parent_[top] != top) {
    flip ^= isFlipped_[top];
    top = parent_[top];
  }
  while (parent_[i] != top && i != top) {
    const std::uint32_t next = parent_[i];
    const std::uint8_t own = isFlipped_[i];
    parent_[i] = top;
    isFlipped_[i] = flip;
    flip ^= own;
    i = next;
  }
  return top;
}

bool SignedForest::join(std::uint32_t i, std::uint32_t j, bool opposite)
{
  std::uint32_t a = root(i), b = root(j);
  if (a == b)
    return false;
  const std::uint8_t flip = isFlipped_[i] ^ isFlipped_[j] ^ static_cast<std::uint8_t>(opposite);
  if (size_[a] < size_[b])
    std::swap(a, b);
  parent_[b] = a;
  isFlipped_[b] = flip;
  size_[a] += size_[b];
  return true;
}

OrientationGraph::OrientationGraph(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                   const NeighborSearch& search, const Reach& reach, float minCosine,
                                   const std::function<void(const Edge&)>& visit, Execution& execution)
    : positions_(points.positions), normals_(normals), minCosine_(minCosine)
{
  requireRoom(points.size());
  neighbors_.assign(points.size() * maxNeighbors, noPoint);
  areas_.assign(points.size(), 0);
  findNeighbors(search, reach, execution);
  execution.poll();
  DisjointSets connected(points.size());
  sortIntoBuckets(visit, connected, execution);
  execution.poll();
  connectPieces(search, reach, visit, connected, execution);
}

void OrientationGraph::requireRoom(std::size_t points, std::size_t moreEdges)
{
  constexpr std::size_t max = std::size_t{1} << edge_key::placeBits;
  if (points <= max / maxNeighbors && moreEdges <= max - points * maxNeighbors)
    return;
  throw ResourceLimit("the normals of " + std::to_string(points) + " points cannot be oriented, at most " +
                      std::to_string(max / maxNeighbors) +
                      " can; thin the cloud out, split it, or give it normals that are used as they are");
}

void OrientationGraph::findNeighbors(const NeighborSearch& search, const Reach& reach, Execution& execution)
{
  search.forEachPosition(positions_, static_cast<int>(maxNeighbors) + 1, NeighborSearch::Answer::indicesAndDistances,
                         execution, [&](const NeighborBatch& batch) {
                           for (std::size_t q = 0; q < batch.size; ++q) {
                             const std::size_t i = batch.positions[q];
                             std::size_t filled = 0;
                             for (std::size_t n = q * batch.k; n < (q + 1) * batch.k && filled < maxNeighbors; ++n) {
                               if (batch.indices[n] == i ||
                                   !reach.joins(i, batch.indices[n], batch.squaredDistances[n]))
                                 continue;
                               areas_[i] = batch.squaredDistances[n] / static_cast<float>(filled + 1);
                               neighbors_[i * maxNeighbors + filled++] = batch.indices[n];
                             }
                           }
                         });
}

void OrientationGraph::sortIntoBuckets(const std::function<void(const Edge&)>& visit, DisjointSets& connected,
                                       Execution& execution)
{
  buckets_.assign(neighbors_.size(), noEdge);
  const auto lists = [&](std::size_t i, std::uint32_t j) {
    const auto first = neighbors_.begin() + i * maxNeighbors;
    return std::find(first, first + maxNeighbors, j) != first + maxNeighbors;
  };
  execution.forRange(positions_.size(), graphGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t place = i * maxNeighbors; place < (i + 1) * maxNeighbors; ++place) {
        const std::uint32_t j = neighbors_[place];
        if (j == noPoint)
          break;
        if (!hasNormal(i) || !hasNormal(j) || (j < i && lists(j, static_cast<std::uint32_t>(i))))
          continue;
        const Edge edge = grade(static_cast<std::uint32_t>(i), j);
        buckets_[place] = bucketOf(edge);
        visit(edge);
        connected.join(static_cast<std::uint32_t>(i), j);
      }
  });
}

void OrientationGraph::connectPieces(const NeighborSearch& search, const Reach& reach,
                                     const std::function<void(const Edge&)>& visit, DisjointSets& connected,
                                     Execution& execution)
{
  // The nearest neighbors may all lie on one scan line: the whole reach is searched if maxNeighbors cut off a piece.
  const std::size_t count = positions_.size();
  if (count == 0)
    return;
  const std::uint32_t largest = connected.largest(execution);
  using Ends = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  more_ = joined(partsOf<Ends, std::uint32_t>(
      execution, count, graphGrain, [&](Ends& found, std::uint32_t begin, std::uint32_t end) {
        Neighbors around;
        std::vector<std::uint32_t> reached;
        for (std::uint32_t i = begin; i < end; ++i) {
          const bool isFull = neighbors_[(std::size_t{i} + 1) * maxNeighbors - 1] != noPoint;
          if (!hasNormal(i) || !isFull || connected.find(i) == largest)
            continue;
          reached.assign(1, connected.find(i));
          const int number = search.within(positions_[i], reach.of(i), around);
          for (int n = 0; n < number; ++n) {
            const auto j = static_cast<std::uint32_t>(around.indices[n]);
            if (!hasNormal(j) || !reach.joins(i, j, around.squaredDistances[n]) ||
                std::find(reached.begin(), reached.end(), connected.find(j)) != reached.end())
              continue;
            reached.push_back(connected.find(j));
            found.emplace_back(i, j);
          }
        }
      }));
  requireRoom(count, more_.size());
  for (const auto& [a, b] : more_) {
    const Edge edge = grade(a, b);
    buckets_.push_back(bucketOf(edge));
    visit(edge);
  }
}

std::pair<std::uint32_t, std::uint32_t> OrientationGraph::ends(std::size_t place) const
{
  if (place >= neighbors_.size())
    return more_[place - neighbors_.size()];
  return {static_cast<std::uint32_t>(place / maxNeighbors), neighbors_[place]};
}

/// Sign and quality of an edge from the reflection of one normal at the bisector plane of the edge.
///
/// n_a' = n_a − 2 (ê·n_a) ê equals n_b on a circular arc, or −n_b if the two have opposite signs. The quality falls
/// with the angle between n_a' and ±n_b, and with that between the edge and the tangent planes: an edge along both
/// normals leads to the opposite sheet of a thin object or, in overlapping scans, to another layer of the same sheet.
Edge OrientationGraph::grade(std::uint32_t a, std::uint32_t b) const
{
  const Eigen::Vector3f &na = normals_[a], &nb = normals_[b];
  const Eigen::Vector3f e = positions_[b] - positions_[a];
  const float length = e.norm();
  const float ta = length > 0 ? e.dot(na) / length : 0, tb = length > 0 ? e.dot(nb) / length : 0;
  const float cosine = na.dot(nb), reflected = cosine - 2 * ta * tb;
  Edge edge;
  edge.a = a;
  edge.b = b;
  edge.opposite = reflected < 0;
  edge.withinAngle = std::abs(cosine) >= minCosine_;
  edge.acrossSheets = std::min(std::abs(ta), std::abs(tb)) > alongNormals;
  edge.quality = std::clamp(std::abs(reflected) * (1 - std::max(ta * ta, tb * tb)), 0.0f, 1.0f);
  return edge;
}

std::uint8_t OrientationGraph::bucketOf(const Edge& edge)
{
  // Eight buckets per octave, because most edges are good: badness is zero or at least 2⁻²⁴.
  constexpr std::uint32_t perOctave = 8, firstOctave = 127 - 24;
  const std::uint32_t bits = bitsOf(1 - edge.quality);
  return static_cast<std::uint8_t>(bits == 0 ? 0 : (bits >> 20) - perOctave * firstOctave + 1);
}

/// Keys of the edges in these buckets that still join two trees, best first.
std::vector<std::uint64_t> OrientationGraph::collect(int first, int last, const SignedForest& forest,
                                                     Execution& execution) const
{
  constexpr std::int64_t places = graphGrain * static_cast<std::int64_t>(maxNeighbors);
  const auto width = static_cast<std::uint8_t>(last - first);
  std::vector<std::uint64_t> edges = joined(partsOf<std::vector<std::uint64_t>>(
      execution, buckets_.size(), places, [&](std::vector<std::uint64_t>& part, std::size_t begin, std::size_t end) {
        for (std::size_t place = begin; place < end; ++place) {
          // Buckets below the first one wrap around to large numbers. Places without an edge are above the last bucket.
          if (static_cast<std::uint8_t>(buckets_[place] - first) > width)
            continue;
          const auto [a, b] = ends(place);
          if (forest.rootOf(a) != forest.rootOf(b))
            part.push_back(edge_key::of(grade(a, b).quality, place));
        }
      }));
  // Sorted by badness and the first bits of the place. The sort is stable, and places come in ascending order.
  sortByUpperHalf(edges, execution);
  return edges;
}

SignedForest OrientationGraph::bestTree(const std::function<bool(const Edge&, SignedForest&)>& isUsed,
                                        Execution& execution) const
{
  std::array<std::size_t, lastBucket + 1> sizes{};
  for (const std::uint8_t bucket : buckets_)
    if (bucket != noEdge)
      ++sizes[bucket];
  SignedForest forest(positions_.size());
  // Edges are sorted in growing portions, because most of the later edges join nothing any more.
  std::size_t portion = std::max<std::size_t>(positions_.size() / 2, 1 << 16);
  for (int first = 0, last = 0; first <= lastBucket; first = last + 1) {
    std::size_t edges = sizes[first];
    for (last = first; last < lastBucket && edges + sizes[static_cast<std::size_t>(last) + 1] <= portion; ++last)
      edges += sizes[static_cast<std::size_t>(last) + 1];
    if (edges == 0)
      continue;
    portion *= 2;
    for (const std::uint64_t entry : collect(first, last, forest, execution)) {
      const auto place = edge_key::placeOf(entry);
      const auto [a, b] = ends(place);
      if (forest.root(a) == forest.root(b))
        continue;
      const Edge candidate = grade(a, b);
      if (isUsed(candidate, forest))
        forest.join(a, b, candidate.opposite);
    }
    execution.poll();
  }
  return forest;
}

} // namespace pcl::mrf

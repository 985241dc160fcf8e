// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/part_cutting.h"

#include "mesh/self_intersection.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <functional>
#include <numeric>
#include <set>
#include <utility>

namespace pcl::mrf {
namespace {

using Box = Eigen::AlignedBox3f;

/// Width of a strip to each side of a seam, in edges.
constexpr int stripWidth = 8;

/// Spreads part numbers to the vertices around that have none, ring by ring.
/// \param largest number of vertices at which a part stops to grow
PartNumbers spread(PartNumbers numbers, const std::vector<Triangle>& triangles, std::int64_t largest)
{
  std::vector<std::int64_t> counts(std::max(0, *std::max_element(numbers.begin(), numbers.end()) + 1), 0);
  for (const std::int32_t number : numbers)
    if (number >= 0)
      ++counts[number];
  for (int ring = 0; ring <= stripWidth; ++ring) {
    const PartNumbers before = numbers;
    const std::vector<std::int64_t> countsBefore = counts;
    for (const Triangle& t : triangles)
      for (const std::int32_t v : t)
        for (const std::int32_t w : t)
          // The first two rings are always needed: one that may change, one that stays. The smallest number wins, so
          // that no other one takes vertices beside it.
          if (before[v] >= 0 && before[w] < 0 && (numbers[w] < 0 || before[v] < numbers[w]) &&
              (ring < 2 || countsBefore[before[v]] < largest)) {
            if (numbers[w] >= 0)
              --counts[numbers[w]];
            numbers[w] = before[v];
            ++counts[before[v]];
          }
  }
  return numbers;
}

/// Bounding box of each group's triangles. \param groupOf group of a triangle, < 0: none
template <typename GroupOf>
std::vector<Box> boxesOf(const TriangleMesh& mesh, const GroupOf& groupOf)
{
  std::vector<Box> boxes;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::int32_t group = groupOf(t);
    if (group < 0)
      continue;
    boxes.resize(std::max(boxes.size(), static_cast<std::size_t>(group) + 1));
    for (const std::int32_t v : mesh.triangles[t])
      boxes[group].extend(mesh.vertices[v]);
  }
  return boxes;
}

} // namespace

PartNumbers cutIntoBoxes(const std::vector<Eigen::Vector3f>& positions, std::int64_t largest)
{
  using Iterator = std::vector<std::int32_t>::iterator;
  PartNumbers parts(positions.size(), -1);
  std::int32_t made = 0;
  const std::function<void(Iterator, Iterator)> cut = [&](Iterator begin, Iterator end) {
    const std::int64_t count = (end - begin + largest - 1) / largest;
    if (count <= 1) {
      std::for_each(begin, end, [&](std::int32_t v) { parts[v] = made; });
      ++made;
      return;
    }
    Box box;
    std::for_each(begin, end, [&](std::int32_t v) { box.extend(positions[v]); });
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const Iterator middle = begin + (end - begin) * (count / 2) / count;
    std::nth_element(begin, middle, end, [&](std::int32_t v, std::int32_t w) {
      return std::make_pair(positions[v][axis], v) < std::make_pair(positions[w][axis], w);
    });
    cut(begin, middle);
    cut(middle, end);
  };
  std::vector<std::int32_t> order(positions.size());
  std::iota(order.begin(), order.end(), 0);
  cut(order.begin(), order.end());
  return parts;
}

PartNumbers stripsAlong(const PartNumbers& seams, const std::vector<Triangle>& triangles, std::int64_t largest)
{
  const PartNumbers strips = spread(seams, triangles, largest);
  std::set<std::pair<std::int32_t, std::int32_t>> neighbors; // the larger number first
  for (const Triangle& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [smaller, larger] = std::minmax({strips[t[i]], strips[t[(i + 1) % 3]]});
      if (smaller >= 0 && smaller < larger)
        neighbors.emplace(larger, smaller);
    }
  std::set<std::int32_t> present(seams.begin(), seams.end()), chosen;
  for (const std::int32_t part : present) {
    const auto isBesideChosen = [&](const auto& pair) { return pair.first == part && chosen.count(pair.second) > 0; };
    if (part >= 0 && std::none_of(neighbors.begin(), neighbors.end(), isBesideChosen))
      chosen.insert(part);
  }
  PartNumbers ofChosen = seams;
  for (std::int32_t& part : ofChosen)
    part = chosen.count(part) > 0 ? part : -1;
  return spread(std::move(ofChosen), triangles, largest);
}

MeshExtract MeshExtractor::operator()(const std::vector<std::int32_t>& triangles)
{
  MeshExtract result;
  for (const std::int32_t t : triangles) {
    Triangle triangle = mesh_.triangles[t];
    for (std::int32_t& v : triangle) {
      if (places_[v] < 0) {
        places_[v] = static_cast<std::int32_t>(result.vertices.size());
        result.vertices.push_back(v);
        result.mesh.vertices.push_back(mesh_.vertices[v]);
      }
      v = places_[v];
    }
    result.mesh.triangles.push_back(triangle);
  }
  for (const std::int32_t v : result.vertices)
    places_[v] = -1;
  return result;
}

std::vector<std::int32_t> intersectingInGroups(const TriangleMesh& mesh, const std::vector<std::int32_t>& groups,
                                               Pairs pairs, Execution& execution)
{
  // Triangles of a run are mostly close to each other: a run is skipped if its box is apart from the group's.
  constexpr std::size_t runLength = 1024;
  std::vector<std::int32_t> result;
  MeshExtractor extract(mesh);
  const std::vector<Box> boxes = boxesOf(mesh, [&](std::size_t t) { return groups[t]; }),
                         boxesOfRuns =
                             boxesOf(mesh, [&](std::size_t t) { return static_cast<std::int32_t>(t / runLength); });
  for (std::size_t group = 0; group < boxes.size(); ++group) {
    execution.poll();
    std::vector<std::int32_t> near;
    std::vector<std::uint8_t> marked;
    for (std::size_t t = 0; t < groups.size(); ++t) {
      if (t % runLength == 0 && !boxesOfRuns[t / runLength].intersects(boxes[group])) {
        t += runLength - 1;
        continue;
      }
      if (groups[t] == noGroup)
        continue;
      Box box;
      for (const std::int32_t v : mesh.triangles[t])
        box.extend(mesh.vertices[v]);
      if (box.intersects(boxes[group])) {
        near.push_back(static_cast<std::int32_t>(t));
        marked.push_back(groups[t] == static_cast<std::int32_t>(group) ? 1 : 0);
      }
    }
    const auto ownCount = static_cast<std::size_t>(std::count(marked.begin(), marked.end(), 1));
    if (pairs == Pairs::acrossGroups && 2 * ownCount > marked.size()) // mark the others instead, which are fewer
      std::transform(marked.begin(), marked.end(), marked.begin(),
                     [](std::uint8_t own) { return static_cast<std::uint8_t>(1 - own); });
    for (const std::int32_t t : selfIntersectingTriangles(extract(near).mesh, execution, marked))
      result.push_back(near[t]);
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/parts.h"

#include "base/loops.h"
#include "base/select_values.h"
#include "base/spatial_sort.h"
#include "mesh/mesh_topology.h"
#include "remesher/intersection_watch.h"
#include "remesher/part_task.h"
#include "remesher/passes.h"

#include <algorithm>
#include <utility>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

/// Max number of attempts to make parts that do not intersect others; after these a part stays as it was.
constexpr int maxAttempts = 8;

/// The numbers of an extract's vertices in the whole, after splitFans() has given some of them copies.
std::vector<std::int32_t> numbersAfterSplitting(MeshExtract& extract)
{
  const std::vector<Triangle> triangles = extract.mesh.triangles;
  splitFans(extract.mesh);
  std::vector<std::int32_t> numbers(extract.mesh.vertices.size(), -1);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i)
      numbers[extract.mesh.triangles[t][i]] = extract.vertices[triangles[t][i]];
  return numbers;
}

/// Remeshes all parts of a mesh once. New triangles are added to the mesh; those they replace are removed at the end.
class PartsRun {
public:
  PartsRun(PartedMesh& mesh, const PartNumbers& parts, const RemeshPlan& plan, const ZeroLevel& level,
           const RemesherOptions& options, Execution& execution)
      : all_(mesh), parts_(parts), plan_(plan), level_(level), options_(options), execution_(execution),
        formerTriangles_(mesh.mesh.triangles.size()), free_(parts),
        counts_(static_cast<std::size_t>(std::max(-1, *std::max_element(parts.begin(), parts.end())) + 1))
  {
    for (const Triangle& t : all_.mesh.triangles)
      if (parts_[t[0]] != parts_[t[1]] || parts_[t[1]] != parts_[t[2]])
        for (const std::int32_t v : t)
          free_[v] = -1;
    if (all_.seams.empty())
      all_.seams = parts_;
    for (std::size_t v = 0; v < free_.size(); ++v)
      if (free_[v] >= 0)
        all_.seams[v] = -1;
  }

  void run(RemeshResult& result)
  {
    std::vector<std::uint8_t> isToDo(counts_.size(), 1);
    float radius = .5f * plan_.targetEdge;
    int attempt = 0;
    do {
      remeshParts(isToDo);
      isToDo = pinWhatIntersects(attempt < maxAttempts ? radius : 0);
      radius *= 2;
      ++attempt;
    } while (std::count(isToDo.begin(), isToDo.end(), 1) > 0);
    for (const RemeshSummary& own : counts_)
      result.add(own);
    dropWhatIsReplaced();
  }

private:
  bool stays(const Triangle& t) const
  {
    return std::all_of(t.begin(), t.end(), [this](std::int32_t v) { return free_[v] < 0; });
  }

  void remeshParts(const std::vector<std::uint8_t>& isToDo)
  {
    for (std::int32_t& group : groups_)
      if (group >= 0 && isToDo[group])
        group = replaced;
    groups_.resize(all_.mesh.triangles.size(), replaced);
    for (std::size_t t = 0; t < formerTriangles_; ++t)
      groups_[t] = stays(all_.mesh.triangles[t]) ? -1 : replaced;
    std::vector<std::vector<std::int32_t>> triangles = trianglesOfParts(isToDo);
    MeshExtractor extract(all_.mesh);
    std::vector<std::size_t> toDo;
    for (std::size_t part = 0; part < counts_.size(); ++part)
      if (isToDo[part]) {
        counts_[part] = RemeshSummary();
        if (!triangles[part].empty())
          toDo.push_back(part);
      }
    remeshEach(
        static_cast<int>(toDo.size()),
        [&](int n) {
          const std::size_t part = toDo[n];
          return inputOf(static_cast<std::int32_t>(part), extract(std::exchange(triangles[part], {})));
        },
        [&](int n, const RemeshedPiece& result) {
          add(result, static_cast<std::int32_t>(toDo[n]));
          execution_.progress((n + 1.) / static_cast<double>(toDo.size()));
        },
        execution_);
  }

  /// The triangles of free vertices, and one ring more, so that a seam is not a border.
  std::vector<std::vector<std::int32_t>> trianglesOfParts(const std::vector<std::uint8_t>& isToDo) const
  {
    std::vector<std::uint8_t> isNearFree(free_.size(), 0);
    const auto forFormer = [&](const auto& body) {
      for (std::size_t t = 0; t < formerTriangles_; ++t)
        body(static_cast<std::int32_t>(t), all_.mesh.triangles[t]);
    };
    forFormer([&](std::int32_t, const Triangle& triangle) {
      if (!stays(triangle))
        for (const std::int32_t v : triangle)
          isNearFree[v] = 1;
    });
    std::vector<std::vector<std::int32_t>> result(counts_.size());
    forFormer([&](std::int32_t t, const Triangle& triangle) {
      for (const std::int32_t v : triangle) {
        const std::int32_t part = isNearFree[v] ? parts_[v] : -1;
        if (part >= 0 && isToDo[part] && (result[part].empty() || result[part].back() != t))
          result[part].push_back(t);
      }
    });
    return result;
  }

  PartInput inputOf(std::int32_t part, MeshExtract extract) const
  {
    std::vector<std::int32_t> numbers = numbersAfterSplitting(extract);
    PartInput input;
    input.mesh = std::move(extract.mesh);
    input.sizing = selectValues(all_.sizing, numbers);
    input.places = selectValues(all_.places, numbers);
    for (std::int32_t& v : numbers)
      v = free_[v] == part ? -1 : v;
    input.numbers = std::move(numbers);
    input.plan = plan_;
    input.maxStep = level_.maxStep();
    input.options = options_;
    input.field = level_.field();
    return input;
  }

  /// Adds the new vertices and triangles of a part.
  void add(const RemeshedPiece& result, std::int32_t part)
  {
    counts_[part] = result.summary;
    std::vector<std::int32_t> numbers = result.numbers;
    for (std::size_t v = 0; v < numbers.size(); ++v) {
      if (numbers[v] >= 0)
        continue;
      numbers[v] = static_cast<std::int32_t>(all_.mesh.vertices.size());
      all_.mesh.vertices.push_back(result.mesh.vertices[v]);
      all_.seams.push_back(-1);
      if (!all_.sizing.empty())
        all_.sizing.push_back(result.sizing[v]);
      if (!all_.places.empty())
        all_.places.push_back(result.places[v]);
    }
    for (std::size_t t = 0; t < result.mesh.triangles.size(); ++t) {
      const Triangle& own = result.mesh.triangles[t];
      if (std::all_of(own.begin(), own.end(), [&](std::int32_t v) { return result.numbers[v] >= 0; }))
        continue;
      if (std::binary_search(result.intersecting.begin(), result.intersecting.end(), static_cast<std::int32_t>(t)))
        known_.push_back(static_cast<std::int32_t>(groups_.size()));
      groups_.push_back(part);
      all_.mesh.triangles.push_back({numbers[own[0]], numbers[own[1]], numbers[own[2]]});
    }
  }

  /// Makes vertices around triangles that intersect triangles outside of their part no longer free.
  /// \param radius around these; 0: all vertices of the part \return flags of the parts to remesh again
  std::vector<std::uint8_t> pinWhatIntersects(float radius)
  {
    std::vector<Vector3f> centers;
    std::vector<std::uint8_t> isToDo(counts_.size(), 0);
    for (const std::int32_t t : intersectingInGroups(all_.mesh, groups_, Pairs::acrossGroups, execution_)) {
      if (groups_[t] < 0 || std::binary_search(known_.begin(), known_.end(), t))
        continue;
      isToDo[groups_[t]] = 1;
      for (const std::int32_t v : all_.mesh.triangles[t])
        centers.push_back(all_.mesh.vertices[v]);
    }
    if (centers.empty())
      return isToDo;
    std::vector<std::uint8_t> isPinned(all_.mesh.vertices.size(), 0);
    if (radius > 0)
      pinAround(centers, radius, all_.mesh.vertices, isPinned);
    const std::vector<std::uint8_t> isConcerned = isToDo;
    for (std::size_t v = 0; v < free_.size(); ++v)
      if (free_[v] >= 0 && (isPinned[v] || (radius == 0 && isConcerned[free_[v]]))) {
        isToDo[free_[v]] = 1;
        free_[v] = -1;
      }
    return isToDo;
  }

  void dropWhatIsReplaced()
  {
    std::vector<Triangle>& triangles = all_.mesh.triangles;
    std::vector<std::int32_t> number(all_.mesh.vertices.size(), -1);
    std::size_t count = 0;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      if (groups_[t] != replaced) {
        triangles[count++] = triangles[t];
        for (const std::int32_t v : triangles[t])
          number[v] = 0;
      }
    triangles.resize(count);
    count = 0;
    for (std::size_t v = 0; v < number.size(); ++v)
      if (number[v] == 0)
        number[v] = static_cast<std::int32_t>(count++);
    const auto drop = [&](auto& values) {
      for (std::size_t v = 0; v < values.size(); ++v)
        if (number[v] >= 0)
          values[number[v]] = values[v];
      values.resize(std::min(count, values.size()));
    };
    drop(all_.mesh.vertices);
    drop(all_.sizing);
    drop(all_.places);
    drop(all_.seams);
    for (Triangle& t : triangles)
      for (std::int32_t& v : t)
        v = number[v];
  }

  static constexpr std::int32_t replaced = noGroup;

  PartedMesh& all_;
  const PartNumbers& parts_;
  const RemeshPlan& plan_;
  const ZeroLevel& level_;
  const RemesherOptions& options_;
  Execution& execution_;
  const std::size_t formerTriangles_;
  PartNumbers free_;                 ///< per vertex: its part if it may move, or −1
  std::vector<std::int32_t> groups_; ///< per triangle: its part; −1: it stays; or replaced
  std::vector<std::int32_t> known_;  ///< triangles that intersect within their part, ascending
  std::vector<RemeshSummary> counts_;
};

/// partBorders() for a whole mesh, on an extract of the triangles around the vertices concerned.
void partBordersOf(TriangleMesh& mesh, const RemeshPlan& plan, const ZeroLevel& level, Execution& execution)
{
  std::vector<std::int32_t> border;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (plan.nextOnBorder[v] >= 0)
      border.push_back(static_cast<std::int32_t>(v));
  std::vector<std::uint8_t> isShared(mesh.vertices.size(), 0);
  for (const std::int32_t v : sharingPlaces(mesh.vertices, std::move(border)))
    isShared[v] = 1;
  std::vector<std::int32_t> triangles;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (std::any_of(mesh.triangles[t].begin(), mesh.triangles[t].end(), [&](std::int32_t v) { return isShared[v]; }))
      triangles.push_back(static_cast<std::int32_t>(t));
  if (triangles.empty())
    return;
  MeshExtract around = MeshExtractor(mesh)(triangles);
  const std::vector<std::int32_t> numbers = numbersAfterSplitting(around);
  RemeshedSurface surface(around.mesh, level, execution);
  setNormals(surface, execution);
  partBorders(surface);
  for (std::size_t v = 0; v < numbers.size(); ++v)
    if (isShared[numbers[v]])
      mesh.vertices[numbers[v]] = surface.mesh.positions[v];
}

/// Sorts vertices along a space-filling curve, and triangles by their first vertex.
TriangleMesh alongCurve(TriangleMesh mesh, Execution& execution)
{
  const std::vector<std::uint32_t> order =
      spatialOrder(mesh.vertices, std::vector<std::uint8_t>(mesh.vertices.size(), 1), execution);
  std::vector<std::int32_t> number(order.size());
  for (std::size_t n = 0; n < order.size(); ++n)
    number[order[n]] = static_cast<std::int32_t>(n);
  TriangleMesh result;
  result.vertices.reserve(order.size());
  for (const std::uint32_t v : order)
    result.vertices.push_back(mesh.vertices[v]);
  mesh.vertices = std::vector<Vector3f>();
  const auto firstOf = [&](std::int32_t t) {
    const Triangle& own = mesh.triangles[t];
    return std::min({number[own[0]], number[own[1]], number[own[2]]});
  };
  const std::vector<std::int32_t> places = placesByFirstVertex(mesh.triangles.size(), order.size(), firstOf);
  result.triangles.resize(mesh.triangles.size());
  for (std::size_t t = 0; t < places.size(); ++t) {
    const Triangle& own = mesh.triangles[t];
    result.triangles[places[t]] = {number[own[0]], number[own[1]], number[own[2]]};
  }
  return result;
}

} // namespace

void remeshParts(PartedMesh& mesh, const PartNumbers& parts, const RemeshPlan& plan, const ZeroLevel& level,
                 const RemesherOptions& options, RemeshResult& result, Execution& execution)
{
  PartsRun(mesh, parts, plan, level, options, execution).run(result);
}

RemeshResult remeshInParts(TriangleMesh mesh, RemeshPlan plan, const ZeroLevel& level, const RemesherOptions& options,
                           std::int64_t trianglesOfPart, Execution& execution)
{
  const auto triangles = static_cast<double>(mesh.triangles.size()), partSize = static_cast<double>(trianglesOfPart);
  // There are half as many vertices as triangles.
  const auto largest = [](double count) { return std::max<std::int64_t>(static_cast<std::int64_t>(count / 2), 1); };
  PartedMesh now{{std::move(mesh.vertices), std::move(mesh.triangles), {}, {}, {}, {}}, std::move(plan.sizing), {}, {}};
  for (Vector3f& p : now.mesh.vertices)
    if (!p.allFinite())
      p.setZero(); // it is in no triangle, and NaN cannot be sorted
  const PartNumbers boxes =
      cutIntoBoxes(now.mesh.vertices, largest(partSize * std::min(1., triangles / plan.triangles)));
  const auto countIntersecting = [&](const TriangleMesh& whole, const auto& groupOf) {
    std::vector<std::int32_t> groups(whole.triangles.size());
    for (std::size_t t = 0; t < groups.size(); ++t)
      groups[t] = groupOf(t);
    return static_cast<std::int64_t>(intersectingInGroups(whole, groups, Pairs::all, execution).size());
  };
  RemeshResult result;
  result.targetEdge = plan.targetEdge;
  result.intersectingBefore =
      countIntersecting(now.mesh, [&](std::size_t t) { return boxes[now.mesh.triangles[t][0]]; });

  partBordersOf(now.mesh, plan, level, execution);
  Poller poll(execution);
  plan.curves =
      BorderCurves(now.mesh.vertices, plan.nextOnBorder, level.maxStep(), surfaceFinder(level, poll), now.places);
  plan.nextOnBorder = std::vector<std::int32_t>(); // each part has a copy of the plan
  now.mesh.vertices.reserve(now.mesh.vertices.size() + static_cast<std::size_t>(.55 * plan.triangles));
  now.mesh.triangles.reserve(now.mesh.triangles.size() + static_cast<std::size_t>(1.1 * plan.triangles));
  const auto remeshAll = [&](const PartNumbers& numbers) {
    remeshParts(now, numbers, plan, level, options, result, execution);
  };
  execution.beginStep(0, .7); // about the share of the boxes; strips take the rest
  remeshAll(boxes);
  for (double done = .7; *std::max_element(now.seams.begin(), now.seams.end()) >= 0; done += .5 * (1 - done)) {
    execution.beginStep(done, .5 * (1 + done));
    remeshAll(stripsAlong(now.seams, now.mesh.triangles, largest(partSize)));
  }
  result.mesh = alongCurve(std::exchange(now, {}).mesh, execution);
  result.intersecting = countIntersecting(result.mesh, [&](std::size_t t) {
    return static_cast<std::int32_t>(t / static_cast<std::size_t>(trianglesOfPart));
  });
  return result;
}

} // namespace pcl::mrf

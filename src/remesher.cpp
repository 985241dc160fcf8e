#include "border_curves.h"
#include "half_edge_mesh.h"
#include "intersection_watch.h"
#include "spatial_sort.h"
#include "triangle_shape.h"
#include "zero_level.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/remesher.h>
#include <pcl/surface/mrf/self_intersection.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

namespace pcl {
namespace mrf {
namespace {

using Eigen::Vector3f;

constexpr float squared(float value)
{
  return value * value;
}

/// One remeshing run: the mesh, the lengths and the counts that the passes share.
class Remesher {
public:
  /// \param watched where to look for intersections after each round
  Remesher(const TriangleMesh& mesh, const DistanceField& field, const RemesherOptions& options,
           IntersectionWatch::Place watched, Execution& execution)
      : mesh_(mesh), level_(field, .5f * static_cast<float>(field.lattice().spacing)), options_(options),
        execution_(execution)
  {
    target_ = options.targetEdge > 0 ? options.targetEdge : medianEdge();
    checkSize();
    mesh_.compact(execution_);
    setNormals();
    watch_.emplace(watched, mesh_, target_, execution_);
    counts_.intersectingBefore = static_cast<std::int64_t>(watch_->intersectingTriangles(mesh_, execution_).size());
    partBorders();
    curves_ = BorderCurves(mesh_, level_.maxStep(), [&](Vector3f& position) {
      const std::optional<Corner> reached = level_.trace(position);
      if (reached)
        position = reached->position;
      return reached.has_value();
    });
  }

  /// \return nothing if triangles intersect where they were not expected to
  std::optional<RemeshResult> run()
  {
    int round = 0;
    while (round < options_.rounds && runRound()) {
      ++round;
      execution_.progress(static_cast<double>(round) / options_.rounds);
    }
    const TriangleMesh triangles = mesh_.toTriangles();
    const std::vector<std::int32_t> intersecting = selfIntersectingTriangles(triangles, execution_);
    if (watch_->place() == IntersectionWatch::Place::expected && !changeableCorners(mesh_, intersecting).empty())
      return {};
    counts_.intersecting = static_cast<std::int64_t>(intersecting.size());
    counts_.mesh = triangles;
    counts_.targetEdge = target_;
    return std::move(counts_);
  }

private:
  Corner corner(std::int32_t vertex) const { return {mesh_.positions[vertex], mesh_.normals[vertex]}; }

  TriangleShape shape(std::int32_t h) const
  {
    return TriangleShape(corner(mesh_.origin[h]), corner(mesh_.target(h)), corner(mesh_.opposite(h)));
  }

  /// Normal of the triangle of h, twice the area long. Reads positions only: normals may be in the making.
  Vector3f cross(std::int32_t h) const
  {
    const Vector3f& a = mesh_.positions[mesh_.origin[h]];
    return (mesh_.positions[mesh_.target(h)] - a).cross(mesh_.positions[mesh_.opposite(h)] - a);
  }

  float squaredLength(std::int32_t h) const
  {
    return (mesh_.positions[mesh_.target(h)] - mesh_.positions[mesh_.origin[h]]).squaredNorm();
  }

  bool edgePinned(std::int32_t h) const { return mesh_.pinned[mesh_.origin[h]] && mesh_.pinned[mesh_.target(h)]; }

  bool oppositesPinned(std::int32_t h) const
  {
    return mesh_.pinned[mesh_.opposite(h)] && mesh_.pinned[mesh_.opposite(mesh_.twin[h])];
  }

  bool refused()
  {
    ++counts_.refusedOperations;
    return false;
  }

  float medianEdge() const
  {
    std::vector<float> lengths;
    for (std::int32_t h = 0; h < mesh_.halfEdgeCount(); ++h)
      if (mesh_.represents(h))
        lengths.push_back(squaredLength(h));
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    return std::sqrt(*middle);
  }

  /// A tiny target edge would ask for more half-edges than 32 bits can count.
  void checkSize() const
  {
    double area = 0;
    for (std::int32_t h = 0; h < mesh_.halfEdgeCount(); h += 3)
      area += .5 * cross(h).norm();
    const double triangles = area / (.25 * std::sqrt(3.0) * target_ * target_);
    const double limit = 5e8;
    if (triangles > limit) {
      std::ostringstream message;
      message << "RemesherOptions::targetEdge = " << target_ << " would give about " << triangles
              << " triangles; at least " << target_ * std::sqrt(triangles / limit) << " is needed";
      throw ResourceLimit(message.str());
    }
  }

  void setNormals()
  {
    execution_.forRange(mesh_.vertexCount(), vertexGrain, [&](std::int64_t begin, std::int64_t end) {
      for (auto v = static_cast<std::int32_t>(begin); v < end; ++v) {
        if (mesh_.outgoing[v] < 0)
          continue;
        Vector3f sum = Vector3f::Zero();
        mesh_.forOutgoing(v, [&](std::int32_t h) { sum += cross(h); });
        mesh_.normals[v] = level_.normalAt(mesh_.positions[v], sum.normalized());
      }
    });
  }

  /// Vertices of different parts of the border at one place, where trimming left two fans that touch: each moves a
  /// little into its own.
  void partBorders()
  {
    std::vector<std::int32_t> border;
    for (std::int32_t v = 0; v < mesh_.vertexCount(); ++v)
      if (mesh_.onBoundary(v))
        border.push_back(v);
    const auto before = [&](std::int32_t v, std::int32_t w) {
      const Vector3f &p = mesh_.positions[v], &q = mesh_.positions[w];
      return std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
    };
    std::stable_sort(border.begin(), border.end(), before);
    for (auto first = border.begin(), last = first; first != border.end(); first = last) {
      last = std::upper_bound(first, border.end(), *first, before);
      if (last - first > 1)
        for (auto v = first; v != last; ++v)
          retreat(*v);
    }
  }

  /// Straight, for that cannot fail where a fan is a single triangle; relaxing takes it to the zero level.
  void retreat(std::int32_t v)
  {
    Vector3f sum = Vector3f::Zero();
    mesh_.forNeighbours(v, [&](std::int32_t w) { sum += mesh_.positions[w] - mesh_.positions[v]; });
    const Vector3f inwards = sum / static_cast<float>(mesh_.valence[v]);
    for (const float share : {.3f, .15f, .05f}) {
      const Vector3f position = mesh_.positions[v] + share * inwards;
      const Corner moved{position, level_.normalAt(position, mesh_.normals[v])};
      bool fits = true;
      mesh_.forOutgoing(v, [&](std::int32_t h) {
        // Thinner for now, and yet the way to get rid of it; not turned over, whatever the field's normals do.
        const TriangleShape former = shape(h);
        const TriangleShape changed(moved, corner(mesh_.target(h)), corner(mesh_.opposite(h)));
        fits = fits && changed.shape > .5f * former.shape && changed.turnsLittle(former);
      });
      if (fits) {
        moveTo(v, moved);
        return;
      }
    }
  }

  /// One round of all passes. Moves that made triangles intersect are taken back; where that does not help, the round
  /// is repeated with the mesh around them left as it was. \return false if no round can be made any more
  bool runRound()
  {
    before_ = mesh_;
    const RemeshResult countsBefore = counts_;
    std::vector<std::uint8_t> pinned = before_.pinned;
    float radius = .5f * target_;
    for (int attempt = 0; attempt < maxAttempts; ++attempt, radius *= 2) {
      splitLongEdges();
      collapseShortEdges();
      flipEdges();
      mesh_.compact(execution_);
      relax();
      const std::vector<std::int32_t> intersecting = withoutMovesThatIntersect();
      if (intersecting.empty())
        return true; // what was pinned stays so: the next round would run into the same trouble
      std::vector<Vector3f> centres;
      for (const std::int32_t v : intersecting)
        centres.push_back(mesh_.positions[v]);
      pinAround(centres, radius, before_.positions, pinned);
      mesh_ = before_;
      mesh_.pinned = pinned;
      const std::int64_t refusals = counts_.refusedOperations;
      counts_ = countsBefore;
      counts_.refusedOperations = refusals;
    }
    return false;
  }

  /// Takes vertices of intersecting triangles back to where they were before relaxing, and what would be a bad triangle
  /// then as well, until no triangles intersect.
  /// \return the corners of those that do and did not move
  std::vector<std::int32_t> withoutMovesThatIntersect()
  {
    while (true) {
      const std::vector<std::int32_t> corners =
          changeableCorners(mesh_, watch_->intersectingTriangles(mesh_, execution_));
      if (corners.empty())
        return {};
      std::vector<std::int32_t> toReturn;
      for (const std::int32_t v : corners)
        if (hasMoved(v))
          toReturn.push_back(v);
      if (toReturn.empty())
        return corners;
      while (!toReturn.empty()) {
        const std::int32_t v = toReturn.back();
        toReturn.pop_back();
        if (!hasMoved(v))
          continue;
        takeBack(v);
        mesh_.forOutgoing(v, [&](std::int32_t h) {
          if (!shape(h).sound())
            toReturn.insert(toReturn.end(), {mesh_.target(h), mesh_.opposite(h)});
        });
      }
    }
  }

  bool hasMoved(std::int32_t v) const { return mesh_.positions[v] != formerPositions_[v]; }

  void takeBack(std::int32_t v)
  {
    mesh_.positions[v] = formerPositions_[v];
    mesh_.normals[v] = formerNormals_[v];
    if (!mesh_.places.empty())
      mesh_.places[v] = formerPlaces_[v];
    ++counts_.refusedOperations;
  }

  /// Half-edges that fulfil a condition, ascending: looked for in parallel, to be worked on one by one, which few are.
  template <typename Condition>
  std::vector<std::int32_t> halfEdgesWhere(const Condition& holds)
  {
    const std::int64_t count = mesh_.halfEdgeCount();
    std::vector<std::vector<std::int32_t>> found(static_cast<std::size_t>((count + edgeGrain - 1) / edgeGrain));
    execution_.forRange(count, edgeGrain, [&](std::int64_t begin, std::int64_t end) {
      for (auto h = static_cast<std::int32_t>(begin); h < end; ++h)
        if (holds(h))
          found[begin / edgeGrain].push_back(h);
    });
    std::vector<std::int32_t> result;
    for (const auto& part : found)
      result.insert(result.end(), part.begin(), part.end());
    return result;
  }

  bool isLong(std::int32_t h) const
  {
    return mesh_.represents(h) && squaredLength(h) > squared(4 * target_ / 3) && !edgePinned(h);
  }

  /// Edges that a split makes wait for the next round.
  void splitLongEdges()
  {
    for (const std::int32_t h : halfEdgesWhere([&](std::int32_t edge) { return isLong(edge); }))
      if (isLong(h))
        split(h);
  }

  bool split(std::int32_t h)
  {
    const std::int32_t g = mesh_.twin[h];
    const Corner a = corner(mesh_.origin[h]), b = corner(mesh_.target(h));
    double place = -1;
    Vector3f middle = .5f * (a.position + b.position);
    if (g < 0) {
      place = curves_.between(mesh_.places[mesh_.origin[h]], mesh_.places[mesh_.target(h)], .5);
      middle = curves_.at(place);
    }
    const std::optional<Corner> m = level_.trace(middle);
    if (!m)
      return refused();

    const auto halvesFit = [&](std::int32_t side, const Corner& from, const Corner& to) {
      const Corner apex = corner(mesh_.opposite(side));
      TriangleShape former = shape(side);
      former.shape *= .5f; // half a needle is a thinner one, and yet the way to get rid of it
      return TriangleShape(from, *m, apex).mayReplace(former) && TriangleShape(*m, to, apex).mayReplace(former);
    };
    if (!halvesFit(h, a, b) || (g >= 0 && !halvesFit(g, b, a)))
      return refused();
    const std::int32_t vertex = mesh_.split(h, m->position, m->normal);
    if (g < 0)
      mesh_.places[vertex] = place;
    ++counts_.splits;
    return true;
  }

  bool isShort(std::int32_t h) const { return mesh_.represents(h) && squaredLength(h) < squared(4 * target_ / 5); }

  /// The shortest ones first: those next to them may then be long enough. In the order of memory, one vertex would
  /// swallow its neighbours one after the other. In classes of a factor √2, each in the order of memory, because what
  /// is taken from all over the memory costs twice the time.
  void collapseShortEdges()
  {
    std::vector<std::uint64_t> edges;
    for (const std::int32_t h : halfEdgesWhere([&](std::int32_t edge) { return isShort(edge); }))
      edges.push_back(keyOf(h));
    sortByUpperHalf(edges, execution_);
    for (const std::uint64_t edge : edges) {
      const auto h = static_cast<std::int32_t>(edge & 0xffffffff);
      if (!isShort(h))
        continue;
      if (mesh_.twin[h] < 0)
        collapseBorder(h);
      else
        collapse(mesh_.onBoundary(mesh_.target(h)) ? mesh_.twin[h] : h);
    }
  }

  std::uint64_t keyOf(std::int32_t h) const
  {
    int exponent;
    std::frexp(squaredLength(h) / squared(target_), &exponent);
    return static_cast<std::uint64_t>(exponent + 1024) << 32 | static_cast<std::uint32_t>(h);
  }

  /// Merges the target into the origin: on the surface half way between them, else where one of them is; on the border
  /// if one of them is there.
  bool collapse(std::int32_t h)
  {
    const std::int32_t a = mesh_.origin[h], b = mesh_.target(h);
    if (mesh_.pinned[a] || mesh_.pinned[b])
      return false;
    if (!mesh_.mayCollapse(h))
      return refused();
    if (mesh_.onBoundary(a))
      return collapse(h, corner(a)) || refused();
    const std::optional<Corner> middle = level_.trace(.5f * (mesh_.positions[a] + mesh_.positions[b]));
    if (middle && collapse(h, *middle))
      return true;
    return collapse(h, corner(a)) || collapse(h, corner(b)) || refused();
  }

  bool collapse(std::int32_t h, const Corner& merged)
  {
    const std::int32_t a = mesh_.origin[h];
    if (!mergedFits(h, merged))
      return false;
    mesh_.collapse(h);
    mesh_.positions[a] = merged.position;
    mesh_.normals[a] = merged.normal;
    ++counts_.collapses;
    return true;
  }

  /// True if the triangles of both ends may have them merged.
  bool mergedFits(std::int32_t h, const Corner& merged) const
  {
    const std::int32_t g = mesh_.twin[h];
    bool fits = true;
    for (const std::int32_t end : {mesh_.origin[h], mesh_.target(h)}) {
      mesh_.forNeighbours(end, [&](std::int32_t w) {
        // Edges that are too long already must not keep a needle's short one from going.
        const float former = 1.21f * (mesh_.positions[w] - mesh_.positions[end]).squaredNorm();
        fits =
            fits && (mesh_.positions[w] - merged.position).squaredNorm() <= std::max(squared(4 * target_ / 3), former);
      });
      mesh_.forOutgoing(end, [&](std::int32_t spoke) {
        if (!fits || spoke / 3 == h / 3 || (g >= 0 && spoke / 3 == g / 3))
          return;
        TriangleShape former = shape(spoke);
        // Three needles around a tiny triangle: the first collapse thins two of them, the next one takes them away.
        if (former.shape < TriangleShape::minShape)
          former.shape *= .5f;
        fits = TriangleShape(merged, corner(mesh_.target(spoke)), corner(mesh_.opposite(spoke))).mayReplace(former);
      });
    }
    return fits;
  }

  /// The same on the border: half way along its curve, else where one of the ends is.
  bool collapseBorder(std::int32_t h)
  {
    const std::int32_t a = mesh_.origin[h], b = mesh_.target(h);
    if (mesh_.pinned[a] || mesh_.pinned[b])
      return false;
    if (!mesh_.mayCollapseBorder(h))
      return refused();
    const double middle = curves_.between(mesh_.places[a], mesh_.places[b], .5);
    const std::optional<Corner> merged = level_.trace(curves_.at(middle));
    if (merged && collapseBorder(h, *merged, middle))
      return true;
    return collapseBorder(h, corner(a), mesh_.places[a]) || collapseBorder(h, corner(b), mesh_.places[b]) || refused();
  }

  bool collapseBorder(std::int32_t h, const Corner& merged, double place)
  {
    const std::int32_t a = mesh_.origin[h], b = mesh_.target(h);
    if (!followsBorder(mesh_.previousOnBorder(a), merged.position, place, mesh_.nextOnBorder(b)) ||
        !mergedFits(h, merged))
      return false;
    mesh_.collapseBorder(h);
    mesh_.positions[a] = merged.position;
    mesh_.normals[a] = merged.normal;
    mesh_.places[a] = place;
    ++counts_.collapses;
    return true;
  }

  /// True if the border from one vertex over a position to another vertex cuts off no more of its curve than it may.
  bool followsBorder(std::int32_t previous, const Vector3f& position, double place, std::int32_t next) const
  {
    const float distance = .5f * level_.maxStep();
    return curves_.isNear(mesh_.places[previous], place, mesh_.positions[previous], position, distance) &&
           curves_.isNear(place, mesh_.places[next], position, mesh_.positions[next], distance);
  }

  bool isToFlip(std::int32_t h) const
  {
    if (!mesh_.represents(h) || mesh_.twin[h] < 0 || edgePinned(h) || oppositesPinned(h))
      return false;
    const std::int32_t g = mesh_.twin[h];
    return growth(mesh_.origin[h], -1) + growth(mesh_.origin[g], -1) + growth(mesh_.opposite(h), 1) +
               growth(mesh_.opposite(g), 1) <
           0;
  }

  void flipEdges()
  {
    for (const std::int32_t h : halfEdgesWhere([&](std::int32_t edge) { return isToFlip(edge); }))
      if (isToFlip(h))
        flip(h);
  }

  /// By how much the squared deviation from the ideal valence grows if the valence changes by one.
  int growth(std::int32_t vertex, int change) const
  {
    const int deviation = mesh_.valence[vertex] - (mesh_.onBoundary(vertex) ? 4 : 6);
    return 2 * change * deviation + 1;
  }

  bool flip(std::int32_t h)
  {
    const std::int32_t g = mesh_.twin[h];
    const std::int32_t a = mesh_.origin[h], b = mesh_.origin[g], c = mesh_.opposite(h), d = mesh_.opposite(g);
    const int leastA = mesh_.onBoundary(a) ? 2 : 3, leastB = mesh_.onBoundary(b) ? 2 : 3;
    if (mesh_.valence[a] <= leastA || mesh_.valence[b] <= leastB || mesh_.adjacent(c, d))
      return refused();
    const TriangleShape former = shape(h) & shape(g);
    const Corner cornerC = corner(c), cornerD = corner(d);
    if (!TriangleShape(corner(a), cornerD, cornerC).mayReplace(former) ||
        !TriangleShape(cornerD, corner(b), cornerC).mayReplace(former))
      return refused();
    mesh_.flip(h);
    ++counts_.flips;
    return true;
  }

  /// Where a vertex is to go: part of the way to its tangential target, then to the zero level.
  std::optional<Corner> propose(std::int32_t v, const Vector3f& step) const
  {
    return level_.trace(mesh_.positions[v] + step);
  }

  bool mayMove(std::int32_t v, const Corner& moved) const
  {
    bool fits = true;
    mesh_.forOutgoing(v, [&](std::int32_t h) {
      if (fits)
        fits = TriangleShape(moved, corner(mesh_.target(h)), corner(mesh_.opposite(h))).mayReplace(shape(h));
    });
    return fits;
  }

  /// All steps are computed from the same state, in parallel; they are taken one by one, each against the state it
  /// meets.
  void relax()
  {
    const std::int32_t count = mesh_.vertexCount();
    formerPositions_ = mesh_.positions;
    formerNormals_ = mesh_.normals;
    formerPlaces_ = mesh_.places;
    areas_.resize(count);
    steps_.resize(count);
    moved_.assign(count, {});
    settled_.assign(count, 0);
    execution_.forRange(count, vertexGrain, [&](std::int64_t begin, std::int64_t end) {
      for (auto v = static_cast<std::int32_t>(begin); v < end; ++v) {
        areas_[v] = 0;
        mesh_.forOutgoing(v, [&](std::int32_t h) { areas_[v] += cross(h).norm(); });
      }
    });
    execution_.forRange(count, vertexGrain, [&](std::int64_t begin, std::int64_t end) {
      for (auto v = static_cast<std::int32_t>(begin); v < end; ++v) {
        if (mesh_.pinned[v] || mesh_.onBoundary(v))
          continue;
        Vector3f sum = Vector3f::Zero();
        float weight = 0;
        const Vector3f p = mesh_.positions[v], n = mesh_.normals[v];
        mesh_.forNeighbours(v, [&](std::int32_t w) {
          sum += areas_[w] * (mesh_.positions[w] - p);
          weight += areas_[w];
        });
        const Vector3f towards = weight > 0 ? Vector3f(sum / weight) : Vector3f::Zero();
        steps_[v] = options_.relaxation * (towards - n * n.dot(towards));
        settled_[v] = steps_[v].squaredNorm() < squared(minStep * target_) ? 1 : 0;
        if (!settled_[v])
          moved_[v] = propose(v, steps_[v]);
      }
    });
    moveAll();
  }

  /// Vertices of a range whose neighbours all belong to it move while other ranges do the same; the rest move after
  /// them, one by one.
  void moveAll()
  {
    const std::int64_t count = mesh_.vertexCount();
    std::vector<std::uint8_t> isWaiting(static_cast<std::size_t>(count), 0);
    std::vector<std::int64_t> refusals(static_cast<std::size_t>((count + moveGrain - 1) / moveGrain), 0);
    execution_.forRange(count, moveGrain, [&](std::int64_t begin, std::int64_t end) {
      for (auto v = static_cast<std::int32_t>(begin); v < end; ++v) {
        if (mesh_.pinned[v] || settled_[v])
          continue;
        bool isInside = true;
        mesh_.forNeighbours(v, [&](std::int32_t w) { isInside = isInside && w >= begin && w < end; });
        if (!isInside)
          isWaiting[v] = 1;
        else if (!move(v))
          ++refusals[begin / moveGrain];
      }
    });
    for (const std::int64_t refusedInRange : refusals)
      counts_.refusedOperations += refusedInRange;
    for (std::int32_t v = 0; v < count; ++v)
      if (isWaiting[v] && !move(v))
        ++counts_.refusedOperations;
  }

  /// Takes what fits of the vertex's step. \return false if nothing tangential did
  bool move(std::int32_t v)
  {
    if (mesh_.onBoundary(v))
      return moveAlongBorder(v);
    for (const float share : {1.0f, .5f, .25f, 0.0f}) { // the last: to the zero level and no more
      const std::optional<Corner> moved = share < 1 ? propose(v, share * steps_[v]) : moved_[v];
      if (moved && mayMove(v, *moved)) {
        moveTo(v, *moved);
        return share > 0;
      }
    }
    return false;
  }

  void moveTo(std::int32_t v, const Corner& moved)
  {
    mesh_.positions[v] = moved.position;
    mesh_.normals[v] = moved.normal;
  }

  /// Towards the middle between its neighbors along the border's curve.
  bool moveAlongBorder(std::int32_t v)
  {
    const std::int32_t previous = mesh_.previousOnBorder(v), next = mesh_.nextOnBorder(v);
    const double start = mesh_.places[previous], end = mesh_.places[next];
    const double own = curves_.share(start, mesh_.places[v], end);
    for (const float share : {1.0f, .5f, .25f, 0.0f}) {
      const double place =
          curves_.between(start, end, own + static_cast<double>(share * options_.relaxation) * (.5 - own));
      const std::optional<Corner> moved = propose(v, share * (curves_.at(place) - mesh_.positions[v]));
      if (moved && mayMove(v, *moved) && followsBorder(previous, moved->position, place, next)) {
        moveTo(v, *moved);
        mesh_.places[v] = place;
        return share > 0;
      }
    }
    return false;
  }

  /// Share of the target edge below which a step is not worth the way: it changes angles by about a degree.
  static constexpr float minStep = .02f;
  static constexpr std::int64_t vertexGrain = 2048;
  static constexpr std::int64_t edgeGrain = 16384;
  static constexpr std::int64_t moveGrain = 32768; ///< large: vertices at its ends have to wait
  static constexpr int maxAttempts = 8;

  HalfEdgeMesh mesh_, before_;
  ZeroLevel level_;
  const RemesherOptions& options_;
  Execution& execution_;
  float target_ = 0;
  RemeshResult counts_;
  std::vector<float> areas_;
  std::vector<Vector3f> steps_;
  std::vector<std::optional<Corner>> moved_;
  std::vector<std::uint8_t> settled_;
  std::vector<Vector3f> formerPositions_, formerNormals_; ///< before relaxing
  std::vector<double> formerPlaces_;
  BorderCurves curves_;
  std::optional<IntersectionWatch> watch_;
};

template <typename Value>
void checkRange(const char* name, Value value, bool inRange, const char* range)
{
  if (inRange)
    return;
  std::ostringstream message;
  message << "RemesherOptions::" << name << " = " << value << " must be in " << range;
  throw InvalidOption(message.str());
}

} // namespace

void validate(const RemesherOptions& options)
{
  checkRange("rounds", options.rounds, options.rounds >= 0 && options.rounds <= 1000, "[0, 1000]");
  checkRange("targetEdge", options.targetEdge, std::isfinite(options.targetEdge) && options.targetEdge >= 0,
             "[0, inf); 0 = median edge");
  checkRange("relaxation", options.relaxation, options.relaxation > 0 && options.relaxation <= 1, "(0, 1]");
}

RemeshResult remesh(const TriangleMesh& mesh, const DistanceField& field, const RemesherOptions& options,
                    Execution& execution)
{
  validate(options);
  if (options.rounds == 0 || mesh.triangles.empty()) {
    RemeshResult unchanged;
    unchanged.mesh.vertices = mesh.vertices;
    unchanged.mesh.triangles = mesh.triangles;
    return unchanged;
  }
  if (field.empty())
    throw InvalidInput("remeshing needs a distance field, and this one is empty");
  using Place = IntersectionWatch::Place;
  std::optional<RemeshResult> result = Remesher(mesh, field, options, Place::expected, execution).run();
  return result ? *std::move(result) : *Remesher(mesh, field, options, Place::everywhere, execution).run();
}

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/self_intersection.h"

#include "base/loops.h"
#include "mesh/predicates.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

namespace pcl::mrf {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// True if two closed segments in the plane, a b and c d, meet.
bool segmentsMeet(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d)
{
  const int abc = orientation(a, b, c), abd = orientation(a, b, d);
  const int cda = orientation(c, d, a), cdb = orientation(c, d, b);
  if (abc == 0 && abd == 0 && cda == 0 && cdb == 0) // on one line: compare their boxes
    return (a.cwiseMin(b).array() <= c.cwiseMax(d).array()).all() &&
           (c.cwiseMin(d).array() <= a.cwiseMax(b).array()).all();
  return abc * abd <= 0 && cda * cdb <= 0;
}

using Corners = std::array<Vector3d, 3>;

/// The projection to a coordinate plane in which a triangle is not seen edge-on.
struct Projection {
  int first = 0, second = 0;
  int turn = 0; ///< orientation of the projected triangle; 0: the triangle is degenerate

  explicit Projection(const Corners& t)
  {
    const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]).cwiseAbs();
    int axis;
    normal.maxCoeff(&axis);
    // The axis of the largest component is best; the others are tried only if rounding misled that choice.
    for (int i = 0; i < 3 && turn == 0; ++i, axis = (axis + 1) % 3) {
      first = (axis + 1) % 3;
      second = (axis + 2) % 3;
      turn = orientation((*this)(t[0]), (*this)(t[1]), (*this)(t[2]));
    }
  }

  Vector2d operator()(const Vector3d& p) const { return {p[first], p[second]}; }
};

/// True if a segment p q and a triangle in the same plane meet.
bool meetInPlane(const Vector3d& p, const Vector3d& q, const Corners& t)
{
  const Projection project(t);
  const Vector2d a = project(p), b = project(q);
  bool inside = true;
  for (int i = 0; i < 3; ++i) {
    const Vector2d c = project(t[i]), d = project(t[(i + 1) % 3]);
    if (segmentsMeet(a, b, c, d))
      return true;
    inside = inside && orientation(c, d, a) == project.turn;
  }
  return inside;
}

/// True if a closed segment p q meets a closed triangle that is not degenerate.
/// \param sideOfP, sideOfQ sides of p and q against the triangle's plane
bool meet(const Vector3d& p, int sideOfP, const Vector3d& q, int sideOfQ, const Corners& t)
{
  if (sideOfP * sideOfQ > 0)
    return false;
  if (sideOfP == 0 && sideOfQ == 0)
    return meetInPlane(p, q, t);
  const int first = orientation(p, q, t[0], t[1]);
  const int second = orientation(p, q, t[1], t[2]);
  if (first * second < 0)
    return false;
  const int third = orientation(p, q, t[2], t[0]);
  return first * third >= 0 && second * third >= 0;
}

/// Sides of three points against the plane of t.
std::array<int, 3> sidesOf(const Corners& points, const Corners& t)
{
  return {orientation(t[0], t[1], t[2], points[0]), orientation(t[0], t[1], t[2], points[1]),
          orientation(t[0], t[1], t[2], points[2])};
}

bool strictlyOneSided(const std::array<int, 3>& sides)
{
  return sides[0] != 0 && sides[0] == sides[1] && sides[1] == sides[2];
}

bool edgesMeet(const Corners& edges, const std::array<int, 3>& sides, const Corners& t)
{
  for (int i = 0; i < 3; ++i)
    if (meet(edges[i], sides[i], edges[(i + 1) % 3], sides[(i + 1) % 3], t))
      return true;
  return false;
}

/// True if triangles without a common vertex meet. A degenerate triangle counts as its edges.
bool disjointMeet(const Corners& s, const Corners& t)
{
  const std::array<int, 3> sidesOfS = sidesOf(s, t);
  if (strictlyOneSided(sidesOfS))
    return false;
  const std::array<int, 3> sidesOfT = sidesOf(t, s);
  if (strictlyOneSided(sidesOfT))
    return false;
  const bool flat = sidesOfS == std::array<int, 3>{} || sidesOfT == std::array<int, 3>{};
  const bool solidS = !flat || Projection(s).turn != 0;
  const bool solidT = !flat || Projection(t).turn != 0;
  return (solidT && edgesMeet(s, sidesOfS, t)) || (solidS && edgesMeet(t, sidesOfT, s));
}

/// True if triangles with s[0] = t[0] share more than that point: then the opposite edge of one meets the other.
bool fansMeet(const Corners& s, const Corners& t)
{
  const int t1 = orientation(s[0], s[1], s[2], t[1]), t2 = orientation(s[0], s[1], s[2], t[2]);
  if (t1 * t2 > 0)
    return false;
  const int s1 = orientation(t[0], t[1], t[2], s[1]), s2 = orientation(t[0], t[1], t[2], s[2]);
  if (s1 * s2 > 0)
    return false;
  const bool flat = (t1 == 0 && t2 == 0) || (s1 == 0 && s2 == 0);
  const bool solidS = !flat || Projection(s).turn != 0;
  const bool solidT = !flat || Projection(t).turn != 0;
  return (solidS && meet(t[1], t1, t[2], t2, s)) || (solidT && meet(s[1], s1, s[2], s2, t));
}

/// True if s and a triangle with the common edge s[0] s[1] and this other corner are folded flat onto each other.
bool foldedFlat(const Corners& s, const Vector3d& other)
{
  if (orientation(s[0], s[1], s[2], other) != 0)
    return false;
  const Projection project(s);
  return project.turn != 0 && orientation(project(s[0]), project(s[1]), project(other)) == project.turn;
}

/// True if the plane m·(x − origin) = c lies strictly between two triangles for some c. Rounding moves a product by
/// less than the margin: four roundings of 2⁻⁵³ of the terms' magnitudes.
bool separates(const Vector3d& m, const Vector3d& origin, const Corners& s, const Corners& t)
{
  double above = -std::numeric_limits<double>::infinity(), below = -above, magnitude = 0;
  for (int i = 0; i < 3; ++i) {
    const Vector3d p = s[i] - origin, q = t[i] - origin;
    above = std::max(above, m.dot(p));
    below = std::min(below, m.dot(q));
    magnitude = std::max({magnitude, p.cwiseAbs().maxCoeff(), q.cwiseAbs().maxCoeff()});
  }
  return below - above > 4e-15 * magnitude * m.cwiseAbs().sum();
}

/// A quick test that shows for most pairs without a common vertex that they are apart. It tries a plane normal to the
/// line between their centers, and planes through their sides, normal to their triangle.
bool apart(const Corners& s, const Corners& t)
{
  const Vector3d& origin = s[0];
  if (separates(t[0] + t[1] + t[2] - s[0] - s[1] - s[2], origin, s, t))
    return true;
  const Vector3d normalOfS = (s[1] - s[0]).cross(s[2] - s[0]), normalOfT = (t[1] - t[0]).cross(t[2] - t[0]);
  for (int i = 0; i < 3; ++i)
    if (separates((s[(i + 1) % 3] - s[i]).cross(normalOfS), origin, s, t) ||
        separates((t[(i + 1) % 3] - t[i]).cross(normalOfT), origin, t, s))
      return true;
  return false;
}

/// A quick test that shows for most pairs with s[0] = t[0] that they share nothing else. It tries a plane through s[0],
/// normal to the difference of their directions: the other corners of s must be in front of it, those of t behind it.
bool fansApart(const Corners& s, const Corners& t)
{
  const Vector3d s1 = s[1] - s[0], s2 = s[2] - s[0], t1 = t[1] - s[0], t2 = t[2] - s[0];
  const Vector3d alongS = s1 + s2, alongT = t1 + t2;
  const Vector3d m = alongS * alongT.cwiseAbs().sum() - alongT * alongS.cwiseAbs().sum();
  const double margin =
      4e-15 * m.cwiseAbs().sum() *
      s1.cwiseAbs().cwiseMax(s2.cwiseAbs()).cwiseMax(t1.cwiseAbs()).cwiseMax(t2.cwiseAbs()).maxCoeff();
  return m.dot(s1) > margin && m.dot(s2) > margin && m.dot(t1) < -margin && m.dot(t2) < -margin;
}

/// A quick test that shows for most pairs with a common edge s[0] s[1] that they are not folded onto each other: their
/// third corners point away from the edge in opposite directions.
bool unfolded(const Corners& s, const Vector3d& other)
{
  const Vector3d edge = s[1] - s[0], p = s[2] - s[0], q = other - s[0];
  // Dot product of the parts of p and q normal to the edge e, times e²: (p·q) e² − (p·e)(q·e).
  const double along = p.dot(edge) * q.dot(edge), across = p.dot(q) * edge.squaredNorm() - along;
  const double magnitude = p.cwiseAbs().dot(q.cwiseAbs()) * edge.squaredNorm() +
                           p.cwiseAbs().dot(edge.cwiseAbs()) * q.cwiseAbs().dot(edge.cwiseAbs());
  return across < -1e-14 * magnitude;
}

struct Box {
  std::array<float, 3> lower{1, 1, 1}, upper{0, 0, 0}; ///< empty if the triangle is not finite

  bool empty() const { return lower[0] > upper[0]; }

  bool overlaps(const Box& other) const
  {
    // Without branches, as they cannot be predicted: about a third of the pairs overlap, in no order.
    bool result = true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      result &= lower[axis] <= other.upper[axis];
      result &= other.lower[axis] <= upper[axis];
    }
    return result;
  }
};

Box boxOf(const TriangleMesh& mesh, const Triangle& t)
{
  const Eigen::Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
  Box box;
  if (a.allFinite() && b.allFinite() && c.allFinite())
    for (int axis = 0; axis < 3; ++axis) {
      box.lower[axis] = std::min({a[axis], b[axis], c[axis]});
      box.upper[axis] = std::max({a[axis], b[axis], c[axis]});
    }
  return box;
}

/// Finds pairs of triangles with overlapping boxes, one of them marked, by a uniform grid of cells hashed into bins.
/// Unmarked triangles are stored only in bins that have marked ones.
class Bins {
public:
  /// \param marked by triangle; empty: all
  Bins(const TriangleMesh& mesh, const std::vector<std::uint8_t>& marked, Execution& execution)
      : marked_(marked), boxes_(mesh.triangles.size()), first_(mesh.triangles.size() + 1, 0), execution_(execution)
  {
    forEachPolling(execution_, boxes_.size(), grain,
                   [&](std::size_t t) { boxes_[t] = boxOf(mesh, mesh.triangles[t]); });
    chooseCells();
    countCells();
    if (!marked_.empty())
      countNearMarked();
    fill();
  }

  std::int64_t count() const { return static_cast<std::int64_t>(begin_.size()) - 1; }

  /// Calls body(s, t), s ≤ t, for the pairs in the bins of a range. A pair belongs to one cell only, but cells may
  /// share a bin: then a pair may come twice, or a triangle with itself.
  template <typename Body>
  void forPairs(std::int64_t firstBin, std::int64_t lastBin, const Body& body) const
  {
    struct Member {
      Box box;
      std::uint8_t offsets, isMarked;
    };
    std::vector<Member> members;
    for (std::int64_t bin = firstBin; bin < lastBin; ++bin) {
      const std::int32_t begin = begin_[bin], count = begin_[bin + 1] - begin;
      if (count < 2)
        continue;
      members.clear();
      for (std::int32_t i = begin; i < begin + count; ++i)
        members.push_back({boxes_[entries_[i]], offsets_[i], isMarked(entries_[i])});
      for (std::int32_t i = 0; i < count; ++i)
        for (std::int32_t j = i + 1; j < count; ++j) {
          bool isOne = members[i].box.overlaps(members[j].box);
          // The pair belongs to the cell with the lower corner of the boxes' overlap: on each axis a box starts there.
          isOne &= (members[i].offsets & members[j].offsets) == 0;
          isOne &= (members[i].isMarked | members[j].isMarked) != 0;
          if (isOne)
            body(entries_[begin + i], entries_[begin + j]);
        }
    }
  }

private:
  using Cell = Eigen::Matrix<std::int64_t, 3, 1>;

  static constexpr std::int64_t grain = 8192;

  bool isMarked(std::size_t triangle) const { return marked_.empty() || marked_[triangle] != 0; }

  /// Sets origin and side of the cells. The side is 1.5 times the mean size of the marked triangles' boxes.
  void chooseCells()
  {
    std::array<float, 3> lower;
    lower.fill(std::numeric_limits<float>::max());
    double extents = 0;
    std::int64_t marked = 0;
    for (std::size_t t = 0; t < boxes_.size(); ++t) {
      const Box& box = boxes_[t];
      if (box.empty())
        continue;
      float extent = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        lower[axis] = std::min(lower[axis], box.lower[axis]);
        extent = std::max(extent, box.upper[axis] - box.lower[axis]);
      }
      extents += isMarked(t) ? extent : 0;
      marked += isMarked(t) ? 1 : 0;
    }
    origin_ = {lower[0], lower[1], lower[2]};
    side_ = 1.5 * extents / static_cast<double>(std::max<std::int64_t>(marked, 1));
    if (!(side_ > 0))
      side_ = 1;
    std::size_t bins = 1;
    while (bins < boxes_.size())
      bins *= 2;
    mask_ = bins - 1;
  }

  /// The cell of a box's corner, none of whose coordinates is below the origin's.
  Cell cellOf(const std::array<float, 3>& p) const
  {
    return ((Vector3d(p[0], p[1], p[2]) - origin_) * inverseSide_).cast<std::int64_t>();
  }

  /// Counts the cells of each triangle. While they are more than 16 per triangle on average, as with a few triangles
  /// far larger than the mean, it doubles the side of the cells.
  void countCells()
  {
    const double enough = 16.0 * static_cast<double>(boxes_.size());
    for (double total = 2 * enough + 1; total > enough; side_ *= 2) {
      inverseSide_ = 1 / side_;
      total = sumOver(execution_, boxes_.size(), grain, [&](std::size_t t) {
        const Box& box = boxes_[t];
        const double cells =
            box.empty() ? 0 : ((cellOf(box.upper) - cellOf(box.lower)).cast<double>().array() + 1).prod();
        first_[t + 1] = static_cast<std::int64_t>(std::min(cells, enough + 1));
        return cells;
      });
    }
  }

  /// Calls body(bin, offset) for the cells of a triangle. \see offsets_
  template <typename Body>
  void forCells(std::size_t t, const Body& body) const
  {
    if (boxes_[t].empty())
      return;
    const Cell low = cellOf(boxes_[t].lower), high = cellOf(boxes_[t].upper);
    for (std::int64_t k = low.z(); k <= high.z(); ++k)
      for (std::int64_t j = low.y(); j <= high.y(); ++j)
        for (std::int64_t i = low.x(); i <= high.x(); ++i)
          body(binOf(i, j, k), (i > low.x() ? 1 : 0) | (j > low.y() ? 2 : 0) | (k > low.z() ? 4 : 0));
  }

  /// The 64 cells of a block get neighboring bins: triangles close in space are mostly close in memory. The order of
  /// cells differs between blocks, as two blocks may share their bins, and surfaces along the axes fill the same part
  /// of each block.
  std::uint32_t binOf(std::int64_t x, std::int64_t y, std::int64_t z) const
  {
    std::uint64_t hash = static_cast<std::uint64_t>(x >> 2) * 0x9e3779b97f4a7c15ull +
                         static_cast<std::uint64_t>(y >> 2) * 0xd6e8feb86659fd93ull +
                         static_cast<std::uint64_t>(z >> 2) * 0xa0761d6478bd642full;
    hash = (hash ^ (hash >> 32)) * 0x9e3779b97f4a7c15ull; // many sums alone would be alike
    const auto inBlock = static_cast<std::uint64_t>((x & 3) | (y & 3) << 2 | (z & 3) << 4);
    return static_cast<std::uint32_t>(((hash >> 32) ^ inBlock) & mask_);
  }

  /// Counts the cells of unmarked triangles again: only those in bins with marked triangles.
  void countNearMarked()
  {
    hasMarked_.assign(mask_ + 1, 0);
    for (std::size_t t = 0; t < boxes_.size(); ++t)
      if (isMarked(t))
        forCells(t, [&](std::uint32_t bin, int) { hasMarked_[bin] = 1; });
    forEachPolling(execution_, boxes_.size(), grain, [&](std::size_t t) {
      if (isMarked(t))
        return;
      first_[t + 1] = 0;
      forCells(t, [&](std::uint32_t bin, int) { first_[t + 1] += hasMarked_[bin]; });
    });
  }

  void fill()
  {
    // Finds the bins of each triangle in parallel, then sorts the entries by bin in one serial pass.
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    const std::size_t total = first_.back();
    std::vector<std::uint32_t> binOfEntry(total);
    std::vector<std::uint8_t> offsetOfEntry(total);
    forEachPolling(execution_, boxes_.size(), grain, [&](std::size_t t) {
      std::int64_t entry = first_[t];
      if (first_[t + 1] > first_[t])
        forCells(t, [&](std::uint32_t bin, int offset) {
          if (!hasMarked_.empty() && hasMarked_[bin] == 0)
            return;
          binOfEntry[entry] = bin;
          offsetOfEntry[entry++] = static_cast<std::uint8_t>(offset);
        });
    });
    sort(binOfEntry, offsetOfEntry);
  }

  void sort(const std::vector<std::uint32_t>& binOfEntry, const std::vector<std::uint8_t>& offsetOfEntry)
  {
    // begin_[bin + 1] is first the begin of a bin. Filling moves it to the end of that bin.
    begin_.assign(mask_ + 3, 0);
    for (const std::uint32_t bin : binOfEntry)
      ++begin_[bin + 2];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    entries_.resize(binOfEntry.size());
    offsets_.resize(binOfEntry.size());
    Poller poll(execution_);
    for (std::size_t t = 0; t < boxes_.size(); ++t) {
      poll();
      for (std::int64_t entry = first_[t]; entry < first_[t + 1]; ++entry) {
        const std::int32_t place = begin_[binOfEntry[entry] + 1]++;
        entries_[place] = static_cast<std::int32_t>(t);
        offsets_[place] = offsetOfEntry[entry];
      }
    }
    begin_.pop_back();
  }

  const std::vector<std::uint8_t>& marked_;
  std::vector<Box> boxes_;
  std::vector<std::int64_t> first_;     ///< of each triangle: its first entry; and the end
  std::vector<std::uint8_t> hasMarked_; ///< per bin; empty: all triangles are marked
  Vector3d origin_ = Vector3d::Zero();
  double side_ = 1, inverseSide_ = 1;
  std::uint64_t mask_ = 0;
  std::vector<std::int32_t> begin_, entries_; ///< entries of bin b: begin_[b] to begin_[b + 1]
  std::vector<std::uint8_t> offsets_; ///< per entry a bit for each axis, set if its cell is not the triangle's first
  Execution& execution_;
};

bool intersect(const TriangleMesh& mesh, Triangle s, Triangle t)
{
  // Move the common vertices to the front of both, in the same order.
  int common = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = common; j < 3; ++j)
      if (s[i] == t[j]) {
        std::swap(s[common], s[i]);
        std::swap(t[common], t[j]);
        ++common;
        break;
      }
  const auto corners = [&](const Triangle& triangle) -> Corners {
    return {mesh.vertices[triangle[0]].cast<double>(), mesh.vertices[triangle[1]].cast<double>(),
            mesh.vertices[triangle[2]].cast<double>()};
  };
  const Corners a = corners(s), b = corners(t);
  switch (common) {
  case 0:
    return !apart(a, b) && disjointMeet(a, b);
  case 1:
    return !fansApart(a, b) && fansMeet(a, b);
  case 2:
    return !unfolded(a, b[2]) && foldedFlat(a, b[2]);
  default:
    return true;
  }
}

} // namespace

std::vector<std::int32_t> selfIntersectingTriangles(const TriangleMesh& mesh, Execution& execution,
                                                    const std::vector<std::uint8_t>& marked)
{
  const Bins bins(mesh, marked, execution);
  constexpr std::int64_t grain = 4096;
  std::vector<std::int32_t> triangles = joined(partsOf<std::vector<std::int32_t>>(
      execution, bins.count(), grain, [&](std::vector<std::int32_t>& hits, std::size_t begin, std::size_t end) {
        bins.forPairs(begin, end, [&](std::int32_t s, std::int32_t t) {
          if (s != t && intersect(mesh, mesh.triangles[s], mesh.triangles[t]))
            hits.insert(hits.end(), {s, t});
        });
      }));
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

std::vector<std::int32_t> selfIntersectingTriangles(const TriangleMesh& mesh)
{
  Execution serial(1);
  return selfIntersectingTriangles(mesh, serial);
}

} // namespace pcl::mrf

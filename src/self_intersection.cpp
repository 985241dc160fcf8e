#include "predicates.h"

#include <pcl/surface/mrf/self_intersection.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace pcl {
namespace mrf {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Closed segments in the plane.
bool segmentsMeet(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& d)
{
  const int abc = orientation(a, b, c), abd = orientation(a, b, d);
  const int cda = orientation(c, d, a), cdb = orientation(c, d, b);
  if (abc == 0 && abd == 0 && cda == 0 && cdb == 0) // on one line: their boxes tell
    return (a.cwiseMin(b).array() <= c.cwiseMax(d).array()).all() &&
           (c.cwiseMin(d).array() <= a.cwiseMax(b).array()).all();
  return abc * abd <= 0 && cda * cdb <= 0;
}

using Corners = std::array<Vector3d, 3>;

/// The coordinate plane in which a triangle is not seen edge-on, or none.
struct Projection {
  int first = 0, second = 0;
  int turn = 0; ///< orientation of the projected triangle; 0: the triangle is degenerate

  explicit Projection(const Corners& t)
  {
    const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]).cwiseAbs();
    int axis;
    normal.maxCoeff(&axis);
    // The largest component is the best choice; the others matter only if rounding misled it.
    for (int i = 0; i < 3 && turn == 0; ++i, axis = (axis + 1) % 3) {
      first = (axis + 1) % 3;
      second = (axis + 2) % 3;
      turn = orientation((*this)(t[0]), (*this)(t[1]), (*this)(t[2]));
    }
  }

  Vector2d operator()(const Vector3d& p) const { return {p[first], p[second]}; }
};

/// Segment and triangle, all in one plane.
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

/// Closed segment and closed triangle that is not degenerate; the sides of the segment's ends against its plane are
/// known.
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

/// Without a common vertex. A degenerate triangle counts as its edges.
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
  if ((solidT && edgesMeet(s, sidesOfS, t)) || (solidS && edgesMeet(t, sidesOfT, s)))
    return true;
  return false;
}

/// With s[0] and t[0] in common: anything more than that point shows in an edge opposite to it.
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

/// With the edge s[0] s[1] in common and t[2] the other triangle's third corner: folded flat onto each other?
bool foldedFlat(const Corners& s, const Vector3d& other)
{
  if (orientation(s[0], s[1], s[2], other) != 0)
    return false;
  const Projection project(s);
  return project.turn != 0 && orientation(project(s[0]), project(s[1]), project(other)) == project.turn;
}

/// Pairs of triangles whose boxes overlap, from hashed uniform bins.
class Bins {
public:
  explicit Bins(const TriangleMesh& mesh)
  {
    lower_.reserve(mesh.triangles.size());
    upper_.reserve(mesh.triangles.size());
    Eigen::Vector3f origin = Eigen::Vector3f::Constant(std::numeric_limits<float>::max());
    double extents = 0;
    for (const Triangle& t : mesh.triangles) {
      const Eigen::Vector3f &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      lower_.push_back(a.cwiseMin(b).cwiseMin(c));
      upper_.push_back(a.cwiseMax(b).cwiseMax(c));
      finite_.push_back(a.allFinite() && b.allFinite() && c.allFinite());
      if (!finite_.back())
        continue;
      origin = origin.cwiseMin(lower_.back());
      extents += (upper_.back() - lower_.back()).maxCoeff();
    }
    origin_ = origin.cast<double>();
    side_ = 1.5 * extents / static_cast<double>(std::max<std::size_t>(mesh.triangles.size(), 1));
    if (!(side_ > 0))
      side_ = 1;
    fill();
  }

  std::int64_t count() const { return static_cast<std::int64_t>(begin_.size()) - 1; }

  /// Calls body(s, t), s < t, for the pairs that belong to a bin; every pair belongs to exactly one.
  template <typename Body>
  void forPairs(std::int64_t bin, const Body& body) const
  {
    for (std::int32_t i = begin_[bin]; i < begin_[bin + 1]; ++i)
      for (std::int32_t j = i + 1; j < begin_[bin + 1]; ++j) {
        const std::int32_t s = entries_[i], t = entries_[j];
        if (s == t || (lower_[s].array() > upper_[t].array()).any() || (lower_[t].array() > upper_[s].array()).any())
          continue;
        if (binOf(cellOf(lower_[s].cwiseMax(lower_[t]))) == bin)
          body(s, t);
      }
  }

private:
  using Cell = Eigen::Matrix<std::int64_t, 3, 1>;

  Cell cellOf(const Eigen::Vector3f& p) const
  {
    return ((p.cast<double>() - origin_) / side_).array().floor().cast<std::int64_t>();
  }

  std::int64_t binOf(const Cell& cell) const
  {
    std::uint64_t hash = static_cast<std::uint64_t>(cell.x()) * 0x9e3779b97f4a7c15ull;
    hash = (hash ^ (hash >> 32) ^ static_cast<std::uint64_t>(cell.y())) * 0xd6e8feb86659fd93ull;
    hash = (hash ^ (hash >> 32) ^ static_cast<std::uint64_t>(cell.z())) * 0x9e3779b97f4a7c15ull;
    return static_cast<std::int64_t>((hash >> 32) & mask_);
  }

  template <typename Body>
  void forBins(std::size_t t, const Body& body) const
  {
    const Cell low = cellOf(lower_[t]), high = cellOf(upper_[t]);
    for (std::int64_t k = low.z(); k <= high.z(); ++k)
      for (std::int64_t j = low.y(); j <= high.y(); ++j)
        for (std::int64_t i = low.x(); i <= high.x(); ++i)
          body(binOf({i, j, k}));
  }

  /// A few triangles far larger than the mean must not fill all the bins of the volume.
  void coarsen()
  {
    const double limit = 16.0 * static_cast<double>(lower_.size());
    for (;; side_ *= 2) {
      double entries = 0;
      for (std::size_t t = 0; t < lower_.size(); ++t)
        if (finite_[t])
          entries += (((upper_[t] - lower_[t]).cast<double>() / side_).array().floor() + 1).prod();
      if (entries <= limit)
        return;
    }
  }

  void fill()
  {
    coarsen();
    std::size_t bins = 1;
    while (bins < lower_.size())
      bins *= 2;
    mask_ = bins - 1;
    begin_.assign(bins + 1, 0);
    for (std::size_t t = 0; t < lower_.size(); ++t)
      if (finite_[t])
        forBins(t, [&](std::int64_t bin) { ++begin_[bin + 1]; });
    for (std::size_t bin = 0; bin < bins; ++bin)
      begin_[bin + 1] += begin_[bin];
    entries_.resize(static_cast<std::size_t>(begin_.back()));
    std::vector<std::int32_t> end(begin_.begin(), begin_.end() - 1);
    for (std::size_t t = 0; t < lower_.size(); ++t)
      if (finite_[t])
        forBins(t, [&](std::int64_t bin) { entries_[end[bin]++] = static_cast<std::int32_t>(t); });
  }

  std::vector<Eigen::Vector3f> lower_, upper_;
  std::vector<std::uint8_t> finite_;
  Vector3d origin_;
  double side_ = 1;
  std::uint64_t mask_ = 0;
  std::vector<std::int32_t> begin_, entries_; ///< entries of bin b: begin_[b] to begin_[b + 1]
};

bool intersect(const TriangleMesh& mesh, Triangle s, Triangle t)
{
  // Common vertices to the front of both, in the same order.
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
  switch (common) {
  case 0:
    return disjointMeet(corners(s), corners(t));
  case 1:
    return fansMeet(corners(s), corners(t));
  case 2:
    return foldedFlat(corners(s), mesh.vertices[t[2]].cast<double>());
  default:
    return true;
  }
}

} // namespace

std::vector<std::int32_t> selfIntersectingTriangles(const TriangleMesh& mesh, Execution& execution)
{
  const Bins bins(mesh);
  constexpr std::int64_t grain = 4096;
  std::vector<std::vector<std::int32_t>> found(static_cast<std::size_t>((bins.count() + grain - 1) / grain));
  execution.forRange(bins.count(), grain, [&](std::int64_t begin, std::int64_t end) {
    std::vector<std::int32_t>& hits = found[static_cast<std::size_t>(begin / grain)];
    for (std::int64_t bin = begin; bin < end; ++bin)
      bins.forPairs(bin, [&](std::int32_t s, std::int32_t t) {
        if (intersect(mesh, mesh.triangles[s], mesh.triangles[t]))
          hits.insert(hits.end(), {s, t});
      });
  });

  std::vector<std::int32_t> triangles;
  for (const std::vector<std::int32_t>& hits : found)
    triangles.insert(triangles.end(), hits.begin(), hits.end());
  std::sort(triangles.begin(), triangles.end());
  triangles.erase(std::unique(triangles.begin(), triangles.end()), triangles.end());
  return triangles;
}

std::vector<std::int32_t> selfIntersectingTriangles(const TriangleMesh& mesh)
{
  Execution serial(1);
  return selfIntersectingTriangles(mesh, serial);
}

} // namespace mrf
} // namespace pcl

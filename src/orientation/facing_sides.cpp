// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/facing_sides.h"

#include "orientation/orientation_sides.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <iterator>
#include <limits>

namespace pcl::mrf {
namespace {

/// Trees of less than this share are no sides.
constexpr double shareOfSide = .1;

/// Points of a side that are asked which sheet is next to theirs.
constexpr std::size_t askedOfSide = 128;

/// In the reach of a point: sheets farther away are none of the same thin object.
constexpr float farthestSheet = 4;

} // namespace

bool FacingSides::Facing::isDecisive() const
{
  return votes[isOpposite()] >= .2 * askedOfSide && votes[isOpposite()] >= 4 * votes[!isOpposite()];
}

bool FacingSides::isSide(std::uint32_t size) const
{
  return size >= shareOfSide * static_cast<double>(points_.size());
}

/// Whether an edge between the trees of these roots was noted.
bool FacingSides::isNoted(std::uint32_t a, std::uint32_t b, SignedForest& trees) const
{
  return std::any_of(between_.begin(), between_.end(), [&](const Edge& edge) {
    const std::uint32_t c = trees.root(edge.a), d = trees.root(edge.b);
    return (a == c && b == d) || (a == d && b == c);
  });
}

bool FacingSides::isBetween(const Edge& edge, SignedForest& trees)
{
  if (!isSide(trees.size(edge.a)) || !isSide(trees.size(edge.b)))
    return false;
  if (!isNoted(trees.root(edge.a), trees.root(edge.b), trees))
    between_.push_back(edge);
  return true;
}

std::vector<FacingSides::Side> FacingSides::findSides(const std::vector<float>& areas, SignedForest& trees) const
{
  std::vector<Side> sides;
  std::vector<Eigen::Vector4d> sums; // Σ A n and Σ A
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    const std::uint32_t root = trees.root(i);
    if (normals_[i].isZero() || !isSide(trees.size(root)))
      continue;
    const std::size_t side =
        std::find_if(sides.begin(), sides.end(), [&](const Side& s) { return s.root == root; }) - sides.begin();
    if (side == sides.size()) {
      sides.push_back({root, {}, false});
      sums.emplace_back(Eigen::Vector4d::Zero());
    }
    sides[side].points.push_back(i);
    const Eigen::Vector3d normal = normals_[i].cast<double>();
    sums[side] += double{areas[i]} * Eigen::Vector3d(trees.isFlipped(i) ? -normal : normal).homogeneous();
  }
  for (std::size_t side = 0; side < sides.size(); ++side)
    sides[side].isOpen = sums[side].head<3>().norm() > openFrom * sums[side].w();
  return sides;
}

/// The nearest point along the normal of one; the point itself if there is none, or so close that it may be of another
/// layer of the same sheet.
std::uint32_t FacingSides::nextSheet(std::uint32_t i, Neighbors& around) const
{
  const Eigen::Vector3f& position = points_.positions[i];
  search_.within(position, farthestSheet * reach_.of(i), around);
  std::uint32_t next = i;
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t n = 0; n < around.indices.size(); ++n) {
    const std::uint32_t j = around.indices[n];
    const float squared = around.squaredDistances[n], along = (points_.positions[j] - position).dot(normals_[i]);
    if (squared < nearest && squared > 0 && along * along > alongNormals * alongNormals * squared) {
      nearest = squared;
      next = j;
    }
  }
  return nearest > reach_.of(i) * reach_.of(i) ? next : i;
}

/// Of all pairs of sides, the most telling first.
std::vector<FacingSides::Facing> FacingSides::ask(const std::vector<Side>& sides, const OrientationGraph& graph,
                                                  SignedForest& trees) const
{
  std::vector<Facing> facings;
  Neighbors around;
  for (const Side& side : sides)
    for (std::size_t n = 0; n < askedOfSide; ++n) {
      const std::uint32_t i = side.points[n * side.points.size() / askedOfSide], j = nextSheet(i, around);
      const std::uint32_t a = std::min(trees.root(i), trees.root(j)), b = std::max(trees.root(i), trees.root(j));
      const Edge across = graph.grade(i, j);
      if (a == b || !across.acrossSheets || !isSide(trees.size(j)))
        continue;
      auto facing = std::find_if(facings.begin(), facings.end(), [&](const Facing& f) { return f.a == a && f.b == b; });
      if (facing == facings.end())
        facing = facings.insert(facing, {a, b, {}});
      ++facing->votes[trees.isFlipped(i) ^ trees.isFlipped(j) ^ across.opposite];
    }
  std::stable_sort(facings.begin(), facings.end(), [](const Facing& f, const Facing& g) {
    return std::max(f.votes[0], f.votes[1]) > std::max(g.votes[0], g.votes[1]);
  });
  return facings;
}

void FacingSides::join(const OrientationGraph& graph, const std::vector<float>& areas, SignedForest& trees) const
{
  const std::vector<Side> sides = findSides(areas, trees);
  const auto isOpen = [&](std::uint32_t root) {
    return std::any_of(sides.begin(), sides.end(), [&](const Side& s) { return s.root == root && s.isOpen; });
  };
  std::vector<Edge> between;
  std::copy_if(between_.begin(), between_.end(), std::back_inserter(between),
               [&](const Edge& edge) { return isOpen(trees.root(edge.a)) || isOpen(trees.root(edge.b)); });
  if (sides.size() > 1) {
    std::vector<Facing> facings = ask(sides, graph, trees);
    // Two closed ones that nothing connects are two objects.
    facings.erase(std::remove_if(facings.begin(), facings.end(),
                                 [&](const Facing& f) {
                                   return !f.isDecisive() ||
                                          !((isOpen(f.a) && isOpen(f.b)) || isNoted(f.a, f.b, trees));
                                 }),
                  facings.end());
    for (const Facing& facing : facings)
      trees.join(facing.a, facing.b, facing.isOpposite());
  }
  // Two closed ones that touch are two objects as well.
  for (const Edge& edge : between)
    trees.join(edge.a, edge.b, edge.opposite);
}

} // namespace pcl::mrf

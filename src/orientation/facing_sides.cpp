// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/facing_sides.h"

#include "orientation/orientation_sides.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace pcl::mrf {
namespace {

/// Min share of the points of a tree that is a side.
constexpr double shareOfSide = .1;

/// askedOfSide points of each side look for a sheet next to theirs; at least the share `behind` has to see one.
constexpr std::size_t askedOfSide = 128;
constexpr double behind = .2;

/// Max distance of a sheet, in reaches of the point: farther ones are not of the same thin object and do not touch it.
constexpr float farthestSheet = 4;

/// Points within aroundContact reaches of an edge look for what they face. A point faces another one if the cosine
/// between its normal and the edge to it is above facingCosine. The share atContact has to face the other tree.
constexpr float aroundContact = 8, facingCosine = .5f;
constexpr double atContact = .07;

/// If more points than this are around an edge, a part of them is asked.
constexpr std::size_t askedAtContact = 4096;

/// Min |outwardness| of an open side that bulges: all but a tenth of it faces away from its middle.
constexpr double bulging = .8;

} // namespace

bool FacingSides::Facing::isDecisive(double ofAsked) const
{
  return votes[isOpposite()] > 0 && votes[isOpposite()] >= 4 * votes[!isOpposite()] && share() >= ofAsked;
}

bool FacingSides::isSide(std::uint32_t size) const
{
  return size >= shareOfSide * static_cast<double>(points_.size());
}

Eigen::Vector3f FacingSides::normalOf(std::uint32_t i, SignedForest& trees) const
{
  trees.root(i);
  return trees.isFlipped(i) ? Eigen::Vector3f(-normals_[i]) : normals_[i];
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
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    const std::uint32_t root = trees.root(i);
    if (normals_[i].isZero() || !isSide(trees.size(root)))
      continue;
    auto side = std::find_if(sides.begin(), sides.end(), [&](const Side& s) { return s.root == root; });
    if (side == sides.end())
      side = sides.insert(side, Side{root, {}});
    side->points.push_back(i);
  }
  for (Side& side : sides)
    describe(side, areas, trees);
  return sides;
}

/// Sets whether the side is open, and where its outside is.
void FacingSides::describe(Side& side, const std::vector<float>& areas, SignedForest& trees) const
{
  Eigen::Vector4d sum = Eigen::Vector4d::Zero(); // Σ A n and Σ A
  for (const std::uint32_t i : side.points)
    sum += double{areas[i]} * normalOf(i, trees).cast<double>().homogeneous();
  side.isOpen = sum.head<3>().norm() > openFrom * sum.w();
  const double outward = outwardness(
      points_.positions, areas,
      [&](const auto& visit) { std::for_each(side.points.begin(), side.points.end(), visit); },
      [&](std::size_t i) { return normalOf(static_cast<std::uint32_t>(i), trees); });
  if (!side.isOpen || std::abs(outward) >= bulging)
    side.outward = outward < 0 ? -1 : 1;
}

/// The nearest point along point i's normal. It is i itself if there is none, or if the point is within reach: it may
/// then be of another layer of the same sheet.
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

/// The facings of all pairs of sides, the one with most votes first.
std::vector<FacingSides::Facing> FacingSides::askBehind(const std::vector<Side>& sides, const OrientationGraph& graph,
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
        facing = facings.insert(facing, {a, b, {}, askedOfSide});
      ++facing->votes[trees.isFlipped(i) ^ trees.isFlipped(j) ^ across.opposite];
    }
  std::stable_sort(facings.begin(), facings.end(), [](const Facing& f, const Facing& g) {
    return std::max(f.votes[0], f.votes[1]) > std::max(g.votes[0], g.votes[1]);
  });
  return facings;
}

/// Asks points of a side around an edge to another tree whether they face that tree on their outside. Points within
/// whose reach the other tree is have no vote: it may go on from the side's rim there.
FacingSides::Facing FacingSides::askAround(const Edge& edge, const Side& side, SignedForest& trees) const
{
  const std::uint32_t other = trees.root(trees.root(edge.a) == side.root ? edge.b : edge.a);
  Facing facing{side.root, other, {}};
  Neighbors near, around;
  search_.within(points_.positions[edge.a], aroundContact * reach_.of(edge.a), near);
  for (std::size_t at = 0; at < near.indices.size(); at += near.indices.size() / askedAtContact + 1) {
    const std::uint32_t i = near.indices[at];
    if (normals_[i].isZero() || trees.root(i) != side.root)
      continue;
    ++facing.asked;
    // The next sheet outside; if the other tree is closer, it may be another layer of the same sheet.
    const Eigen::Vector3f outward = static_cast<float>(side.outward) * normalOf(i, trees);
    search_.within(points_.positions[i], farthestSheet * reach_.of(i), around);
    std::uint32_t next = i;
    float distance = std::numeric_limits<float>::infinity();
    bool isClose = false;
    for (std::size_t n = 0; n < around.indices.size() && !isClose; ++n) {
      const std::uint32_t j = around.indices[n];
      const float length = std::sqrt(around.squaredDistances[n]);
      if (normals_[j].isZero())
        continue;
      if (length <= reach_.of(i))
        isClose = trees.root(j) == other;
      else if (length < distance && outward.dot(points_.positions[j] - points_.positions[i]) > facingCosine * length) {
        distance = length;
        next = j;
      }
    }
    if (isClose)
      continue;
    const float along = normalOf(next, trees).dot(points_.positions[next] - points_.positions[i]);
    if (trees.root(next) == other && std::abs(along) > facingCosine * distance)
      ++facing.votes[(along > 0) == (side.outward > 0)];
  }
  return facing;
}

/// Joins sides and the trees outside of them so that they face each other, the largest share of votes first.
void FacingSides::joinAtContacts(const std::vector<Side>& sides, const std::vector<Edge>& between,
                                 SignedForest& trees) const
{
  std::vector<Facing> facings;
  for (const Edge& edge : between)
    for (const Side& side : sides)
      if (side.outward != 0 && (side.root == trees.root(edge.a)) != (side.root == trees.root(edge.b)))
        facings.push_back(askAround(edge, side, trees));
  std::stable_sort(facings.begin(), facings.end(),
                   [](const Facing& f, const Facing& g) { return f.share() > g.share(); });
  for (const Facing& facing : facings)
    if (facing.isDecisive(atContact))
      trees.join(facing.a, facing.b, facing.isOpposite());
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
    std::vector<Facing> facings = askBehind(sides, graph, trees);
    // Two sides that no edge connects are two objects, unless both are open.
    facings.erase(std::remove_if(facings.begin(), facings.end(),
                                 [&](const Facing& f) {
                                   return !f.isDecisive(behind) ||
                                          !((isOpen(f.a) && isOpen(f.b)) || isNoted(f.a, f.b, trees));
                                 }),
                  facings.end());
    for (const Facing& facing : facings)
      trees.join(facing.a, facing.b, facing.isOpposite());
    joinAtContacts(sides, between, trees);
  }
  // Two closed sides that touch are two objects as well: `between` has no edge of them.
  for (const Edge& edge : between)
    trees.join(edge.a, edge.b, edge.opposite);
}

} // namespace pcl::mrf

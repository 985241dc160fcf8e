// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/orientation.h>

#include "base/disjoint_points.h"
#include "orientation/orientation_graph.h"
#include "orientation/orientation_sides.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

namespace pcl {
namespace mrf {
namespace {

/// Points per piece of parallel work.
constexpr std::int64_t grain = 4096;

/// Points that edges of at least this quality connect form a piece of smooth surface. Edges to an opposite sheet reach
/// it only where sheets are closer than about an eighth of the neighbor distance.
constexpr float smoothQuality = .95f;

/// Pieces of fewer points are too small for a vote of their own.
constexpr std::uint32_t smallestVotingPiece = 12;

/// Pieces of fewer points, as at the edges of what a sensor sees, do not overrule what their points say.
constexpr std::uint32_t smallestLeadingPiece = 50;

/// A point that its sensor saw from behind by more than this cosine has the wrong sign: 4°, as far as an estimated
/// normal may be off.
constexpr double decisiveCosine = .07;

/// Trees of fewer points are too small to be taken for a side of a thin object.
constexpr double smallestSide = 100;

/// Of the automatic local distance: 2.5 /√ρ with ρ points per area.
constexpr float reachInSpacings = 5;

/// Which of the normals have to be turned for each component to be consistent; most keep the sign they came with, so
/// that flips mean something where normals were given.
std::vector<std::uint8_t> flipsOf(const Partition& components, const SignedForest& forest)
{
  std::vector<std::uint8_t> isFlipped(components.set.size());
  std::vector<std::uint32_t> flipped(components.sizes.size(), 0);
  for (std::uint32_t i = 0; i < isFlipped.size(); ++i) {
    isFlipped[i] = forest.isFlipped(i);
    flipped[components.set[i]] += isFlipped[i];
  }
  for (std::size_t i = 0; i < isFlipped.size(); ++i) {
    const std::uint32_t set = components.set[i];
    if (2 * flipped[set] > components.sizes[set])
      isFlipped[i] ^= 1;
  }
  return isFlipped;
}

/// The sensor that saw a point: of its view, or the nearest one where the view is not known.
const Eigen::Vector3f& sensorOf(const PointSet& points, std::size_t i)
{
  if (!points.views.empty() && points.views[i] >= 0 &&
      static_cast<std::size_t>(points.views[i]) < points.sensors.size())
    return points.sensors[static_cast<std::size_t>(points.views[i])];
  const auto distance = [&](const Eigen::Vector3f& sensor) { return (sensor - points.positions[i]).squaredNorm(); };
  return *std::min_element(
      points.sensors.begin(), points.sensors.end(),
      [&](const Eigen::Vector3f& s, const Eigen::Vector3f& t) { return distance(s) < distance(t); });
}

/// What a point's normal, as it is, says about its component's sign: value > 0 for, < 0 against, |value| ≤ weight.
struct Vote {
  double value = 0, weight = 0;
};

/// How the points vote. A vote is computed whenever it is asked for: kept, votes would be the largest array of all.
class Voters {
public:
  /// \param areas that the points stand for \param normals as they are asked for: only their signs may change
  Voters(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const std::vector<float>& areas,
         const Partition& components, OrientationVote vote)
      : points_(points), normals_(normals), areas_(areas), components_(components), vote_(vote)
  {
    if (vote != OrientationVote::outward)
      return;
    moments_.assign(components.sizes.size(), Eigen::Vector4d::Zero());
    for (std::size_t i = 0; i < points.size(); ++i)
      moments_[components.set[i]] += double{areas[i]} * points.positions[i].cast<double>().homogeneous();
  }

  Vote operator()(std::size_t i) const
  {
    const auto sign = [](float value) {
      return Vote{value > 0 ? 1.0 : value < 0 ? -1.0 : 0.0, value != 0 ? 1.0 : 0.0};
    };
    if (vote_ == OrientationVote::reference)
      return sign(normals_[i].dot(points_.normals[i]));
    if (vote_ == OrientationVote::sensor)
      return towardsSensor(i);
    const Eigen::Vector4d& moment = moments_[components_.set[i]];
    if (!(moment.w() > 0))
      return {};
    const Eigen::Vector3d arm = points_.positions[i].cast<double>() - moment.hnormalized();
    Vote vote;
    vote.value = areas_[i] * normals_[i].cast<double>().dot(arm);
    // A flat patch has no outside: what rounding and noise leave there must not look like agreement.
    vote.weight = std::max(std::abs(vote.value), .01 * areas_[i] * arm.norm());
    return vote;
  }

private:
  /// By the cosine: a surface seen at a grazing angle hardly tells which side it shows.
  Vote towardsSensor(std::size_t i) const
  {
    const Eigen::Vector3f sight = sensorOf(points_, i) - points_.positions[i];
    const double length = sight.norm();
    const double cosine = length > 0 ? normals_[i].dot(sight) / length : 0;
    return {cosine, std::abs(cosine)};
  }

  const PointSet& points_;
  const std::vector<Eigen::Vector3f>& normals_;
  const std::vector<float>& areas_;
  const Partition& components_;
  OrientationVote vote_;
  std::vector<Eigen::Vector4d> moments_; ///< per component: area and first moment
};

struct Tally {
  double balance = 0, total = 0;
  std::uint32_t points = 0;

  /// Three quarters of the votes of a piece that is large enough.
  bool isDecidedlyAgainst() const { return points >= smallestVotingPiece && -balance >= .5 * total && total > 0; }
};

/// Sums of the votes per set.
std::vector<Tally> tally(const Partition& partition, const Voters& vote)
{
  std::vector<Tally> tallies(partition.sizes.size());
  for (std::size_t i = 0; i < partition.set.size(); ++i) {
    Tally& own = tallies[partition.set[i]];
    const Vote cast = vote(i);
    own.balance += cast.value;
    own.total += cast.weight;
    ++own.points;
  }
  return tallies;
}

/// The components of points whose signs are known: no edge has to be sorted, or kept.
///
/// Edges may be looked at in any order, and need not be once both ends are in one component. Those to the next
/// points in memory, close by in space, make pieces of some twenty points. All edges of each piece's first point join
/// nearly all of them to one component. An edge between two components ends at a point outside of the largest one, so
/// looking at all edges of those finds the rest.
OrientationResult findComponents(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                 const NeighborSearch& search, const Reach& reach, float minCosine,
                                 const OrientationOptions& options, Execution& execution)
{
  constexpr std::size_t following = 8;
  constexpr int edgesToFollowing = 2; // more cost as much as they save
  const std::size_t count = points.size();
  DisjointPoints joined(count), smooth(count);
  /// \return whether the normals of both agree
  const auto join = [&](std::uint32_t i, std::uint32_t j) {
    const Eigen::Vector3f &a = normals[i], &b = normals[j];
    if (i == j || a.isZero() || b.isZero())
      return false;
    const Eigen::Vector3f edge = points.positions[j] - points.positions[i];
    const float alongA = edge.dot(a), alongB = edge.dot(b);
    const float along = alongNormals * alongNormals * edge.squaredNorm();
    const bool acrossSheets = alongA * alongA > along && alongB * alongB > along;
    const bool withinAngle = std::abs(a.dot(b)) >= minCosine;
    if (withinAngle)
      smooth.join(i, j);
    // Without a vote from outside, two sheets can only be taken for the two sides of one object.
    if (!acrossSheets && (withinAngle || options.joinAcrossCreases))
      joined.join(i, j);
    return withinAngle;
  };
  execution.forRange(static_cast<std::int64_t>(count), grain, [&](std::int64_t begin, std::int64_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      int edges = 0;
      for (std::size_t j = i + 1; j < std::min(i + 1 + following, count) && edges < edgesToFollowing; ++j)
        if (reach.joins(i, j, (points.positions[j] - points.positions[i]).squaredNorm()) &&
            join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)))
          ++edges;
    }
  });
  execution.poll();

  // Other threads' joins may make a point unwanted just before its turn: then its edges are known.
  const auto joinAllEdges = [&](const auto& isWanted) {
    execution.forRange(static_cast<std::int64_t>(count), grain, [&](std::int64_t begin, std::int64_t end) {
      Neighbors found;
      for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i)
        if (!normals[i].isZero() && isWanted(i)) {
          search.within(points.positions[i], std::nextafter(reach.of(i), std::numeric_limits<float>::max()), found);
          for (std::size_t n = 0; n < found.indices.size(); ++n)
            if (const auto j = static_cast<std::uint32_t>(found.indices[n]);
                reach.joins(i, j, found.squaredDistances[n]))
              join(i, j);
        }
    });
    execution.poll();
  };
  joinAllEdges([&](std::uint32_t i) { return joined.find(i) == i || smooth.find(i) == i; });
  const std::uint32_t largest = joined.largest(execution), largestSmooth = smooth.largest(execution);
  joinAllEdges([&](std::uint32_t i) {
    return joined.find(i) != joined.find(largest) || smooth.find(i) != smooth.find(largestSmooth);
  });

  OrientationResult result;
  result.normals = normals;
  result.keep.assign(count, 0);
  const auto sizes = joined.sizes(execution);
  const double smallest = options.minComponentShare * static_cast<double>(count);
  const auto sumOver = [&](const auto& term) {
    return static_cast<std::int64_t>(
        execution.sum(static_cast<std::int64_t>(count), grain, [&](std::int64_t begin, std::int64_t end) {
          std::int64_t total = 0;
          for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i)
            total += !normals[i].isZero() && term(i) ? 1 : 0;
          return static_cast<double>(total);
        }));
  };
  const std::int64_t kept = sumOver([&](std::uint32_t i) {
    result.keep[i] = sizes[joined.find(i)] >= smallest ? 1 : 0;
    return result.keep[i] != 0;
  });
  result.pointsDropped = static_cast<std::int64_t>(count) - kept;
  result.components = sumOver([&](std::uint32_t i) { return joined.find(i) == i; });
  result.componentsDropped = sumOver([&](std::uint32_t i) { return joined.find(i) == i && sizes[i] < smallest; });
  result.componentsAtCreases = sumOver([&](std::uint32_t i) { return smooth.find(i) == i; });
  return result;
}

/// How far the points look for neighbors.
Reach reachOf(const PointSet& points, const NeighborSearch& search, const SamplingDensity& density,
              const OrientationOptions& options, Execution& execution)
{
  const float distance = resolvedNeighborDistance(options, density);
  if (options.neighborDistance > 0 || !options.localDistance)
    return Reach(distance);
  std::vector<float> reaches = points.spacings.size() == points.size()
                                   ? points.spacings
                                   : localSpacings(points, measureNeighbors(points, search, execution), execution);
  if (reaches.size() != points.size())
    return Reach(distance);
  for (float& reach : reaches)
    reach *= reachInSpacings;
  return Reach(std::move(reaches));
}

void checkInput(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, OrientationVote vote)
{
  if (normals.size() != points.size())
    throw InvalidInput("orientation got " + std::to_string(normals.size()) + " normals for " +
                       std::to_string(points.size()) + " points");
  if (vote == OrientationVote::sensor && points.sensors.empty())
    throw InvalidInput("an orientation by sensors needs at least one sensor position");
  if (vote == OrientationVote::reference && points.normals.size() != points.size())
    throw InvalidInput("an orientation by reference normals needs a cloud with normals");
}

} // namespace

float resolvedNeighborDistance(const OrientationOptions& options, const SamplingDensity& density)
{
  if (options.neighborDistance > 0)
    return options.neighborDistance;
  if (options.localDistance && density.eighthMedian > 0)
    return reachInSpacings * nearestToEighth * density.eighthMedian;
  return std::max(density.spacing + 6 * density.nearestDeviation, 2.5f * density.spacing);
}

OrientationResult orientNormals(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                const NeighborSearch& search, const SamplingDensity& density, OrientationVote vote,
                                const OrientationOptions& options, Execution& execution)
{
  validate(options);
  checkInput(points, normals, vote);
  const std::size_t count = points.size();
  const Reach reach = reachOf(points, search, density, options, execution);

  const auto minCosine = static_cast<float>(std::cos(options.maxAngle * EIGEN_PI / 180));
  if (vote == OrientationVote::none)
    return findComponents(points, normals, search, reach, minCosine, options, execution);

  const bool knowsViews = vote == OrientationVote::sensor && (!points.views.empty() || points.sensors.size() == 1);
  const bool piecesVote = vote == OrientationVote::reference || knowsViews;
  DisjointPoints withinAngle(count), smooth(piecesVote ? count : 0);
  std::optional<OrientationGraph> graph;
  graph.emplace(
      points, normals, search, reach, minCosine,
      [&](const Edge& edge) {
        if (edge.withinAngle)
          withinAngle.join(edge.a, edge.b);
        if (piecesVote && edge.quality >= smoothQuality)
          smooth.join(edge.a, edge.b);
      },
      execution);
  execution.poll();

  const double smallest = options.minComponentShare * static_cast<double>(count);
  SignedForest forest = graph->bestTree(
      [&](const Edge& edge, SignedForest& trees) {
        if (edge.acrossSheets)
          // Without a vote from outside, two sheets can only be taken for the two sides of one object.
          return options.joinAcrossCreases && vote == OrientationVote::outward &&
                 std::min(trees.size(edge.a), trees.size(edge.b)) >= std::max(smallest, smallestSide);
        return options.joinAcrossCreases || edge.withinAngle;
      },
      execution);
  const std::vector<float> areas = graph->takeAreas();
  graph.reset(); // the largest of all
  const Partition components(count, [&](std::uint32_t i) { return forest.root(i); });

  OrientationResult result;
  result.keep.assign(count, 0);
  std::vector<std::uint8_t> seen(components.sizes.size(), 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (normals[i].isZero())
      continue;
    const bool isKept = components.sizes[components.set[i]] >= smallest;
    result.keep[i] = isKept ? 1 : 0;
    if (components.isFirst(i, seen)) {
      ++result.components;
      result.componentsDropped += isKept ? 0 : 1;
    }
    result.componentsAtCreases += withinAngle.find(i) == i ? 1 : 0;
  }
  result.pointsDropped = std::count(result.keep.begin(), result.keep.end(), std::uint8_t{0});

  result.normals = normals;
  const auto turn = [&](std::size_t i) { result.normals[i] = -result.normals[i]; };
  {
    const std::vector<std::uint8_t> isFlipped = flipsOf(components, forest);
    for (std::size_t i = 0; i < count; ++i)
      if (isFlipped[i])
        turn(i);
  }
  const Voters voters(points, result.normals, areas, components, vote);

  const std::vector<Tally> tallies = tally(components, voters);
  std::vector<std::uint8_t> isTurned(tallies.size());
  std::transform(tallies.begin(), tallies.end(), isTurned.begin(),
                 [](const Tally& own) { return own.balance < 0 ? std::uint8_t{1} : std::uint8_t{0}; });
  if (vote == OrientationVote::outward) {
    const Sides sides = chooseSides(points, result.normals, areas, components, isTurned, reach, search, execution);
    isTurned = sides.isTurned;
    result.openShare = sides.openShare;
    result.sideIsGuessed = sides.isGuess;
  }
  std::fill(seen.begin(), seen.end(), std::uint8_t{0});
  for (std::size_t i = 0; i < count; ++i)
    if (isTurned[components.set[i]]) {
      turn(i);
      result.componentsFlipped += components.isFirst(i, seen) && result.keep[i];
    }

  if (piecesVote) {
    const Partition pieces(count, [&](std::uint32_t i) { return smooth.find(i); });
    const std::vector<Tally> pieceTallies = tally(pieces, voters);
    seen.assign(pieces.sizes.size(), 0);
    for (std::size_t i = 0; i < count; ++i)
      if (pieceTallies[pieces.set[i]].isDecidedlyAgainst()) {
        turn(i);
        result.piecesFlipped += pieces.isFirst(i, seen) && result.keep[i];
      }
    const double decisive = knowsViews ? decisiveCosine : 1;
    for (std::size_t i = 0; i < count; ++i)
      if (voters(i).value < (pieces.sizes[pieces.set[i]] < smallestLeadingPiece ? 0 : -decisive))
        turn(i);
  }

  double agreeing = 0, total = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (!result.keep[i])
      continue;
    const Vote cast = voters(i);
    result.pointsFlipped += result.normals[i].dot(normals[i]) < 0;
    agreeing += (cast.weight + cast.value) / 2;
    total += cast.weight;
  }
  if (total > 0)
    result.agreement = agreeing / total;
  return result;
}

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/orientation.h"

#include "base/disjoint_sets.h"
#include "base/loops.h"
#include "options/validation.h"
#include "orientation/facing_sides.h"
#include "orientation/orientation_graph.h"
#include "orientation/orientation_sides.h"
#include "points/noise.h"
#include "points/sampling_density.h"

#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <utility>

namespace pcl::mrf {
namespace {

/// Points connected by edges of at least this quality form a piece of smooth surface. Edges to an opposite sheet reach
/// this quality only if the sheets are closer than about an eighth of the neighbor distance.
constexpr float smoothQuality = .95f;

/// Min points of a piece or tree that votes as a whole. In smaller pieces, as at a view's edges, each point votes.
constexpr std::uint32_t smallestVotingPiece = 50;

/// Min points of a tree that may be a side of a thin object.
constexpr double smallestSide = 100;

/// The automatic local neighbor distance, in local spacings: 2.5 /√ρ with ρ points per area.
constexpr float reachInSpacings = 5;

/// A point's vote on its component's present sign, or the sum of several: balance > 0 for, < 0 against, |balance| ≤
/// total.
struct Votes {
  double balance = 0, total = 0;

  /// At least three quarters of the votes agree.
  bool isDecided() const { return std::abs(balance) >= .5 * total && total > 0; }
  bool isDecidedlyAgainst() const { return isDecided() && balance < 0; }
};

/// Computes the votes of the points whenever they are asked for. Stored, the votes would be the largest array of all.
class Voters {
public:
  /// \param areas area that each point stands for \param normals read for each vote: only their signs may change
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

  Votes operator()(std::size_t i) const
  {
    const auto sign = [](float value) {
      return Votes{value > 0 ? 1.0 : value < 0 ? -1.0 : 0.0, value != 0 ? 1.0 : 0.0};
    };
    if (vote_ == OrientationVote::reference)
      return sign(normals_[i].dot(points_.normals[i]));
    if (vote_ == OrientationVote::sensor)
      return towardsSensor(i);
    const Eigen::Vector4d& moment = moments_[components_.set[i]];
    if (!(moment.w() > 0))
      return {};
    const Eigen::Vector3d arm = points_.positions[i].cast<double>() - moment.hnormalized();
    const double away = areas_[i] * normals_[i].cast<double>().dot(arm);
    // A flat patch has no outside: its votes from rounding and noise must not look like agreement.
    return {away, std::max(std::abs(away), .01 * areas_[i] * arm.norm())};
  }

private:
  /// A vote weighs by the cosine, because a surface seen at a grazing angle hardly tells which side it shows.
  Votes towardsSensor(std::size_t i) const
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

/// Sums of the votes per set.
std::vector<Votes> tally(const Partition& partition, const Voters& vote)
{
  std::vector<Votes> tallies(partition.sizes.size());
  for (std::size_t i = 0; i < partition.set.size(); ++i) {
    Votes& own = tallies[partition.set[i]];
    const Votes cast = vote(i);
    own.balance += cast.balance;
    own.total += cast.total;
  }
  return tallies;
}

/// How far the points look for neighbors.
Reach reachOf(const PointSet& points, const NeighborSearch& search, const SamplingDensity& density,
              const OrientationOptions& options, Execution& execution)
{
  const float distance = resolvedNeighborDistance(options, density);
  if (options.neighborDistance > 0 || !options.localDistance)
    return Reach(distance);
  std::vector<float> spacings = points.spacings.size() == points.size()
                                    ? points.spacings
                                    : localSpacings(points, measureNeighbors(points, search, execution), execution);
  return spacings.size() == points.size() ? Reach(std::move(spacings), reachInSpacings) : Reach(distance);
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

float minCosineOf(const OrientationOptions& options)
{
  return static_cast<float>(std::cos(options.maxAngle * EIGEN_PI / 180));
}

/// Points per piece of parallel work.
constexpr std::int64_t componentGrain = 4096;

/// Finds the components if all signs are known: edges are neither sorted nor kept, and normals stay as they are.
///
/// Edges may be visited in any order, and are not needed once both ends are in one component. Edges to the next points
/// in memory, which are close by in space, make pieces of some twenty points. All edges of each piece's first point
/// join nearly all pieces to one component. Any other edge between two components ends at a point outside of the
/// largest one, so that visiting all edges of these points finds the rest.
class ComponentFinder {
public:
  ComponentFinder(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const NeighborSearch& search,
                  const Reach& reach, const OrientationOptions& options, Execution& execution)
      : points_(points), normals_(normals), search_(search), reach_(reach), minCosine_(minCosineOf(options)),
        options_(options), execution_(execution), joined_(points.size()), smooth_(points.size())
  {}

  OrientationResult run()
  {
    joinFollowing();
    joinAllEdges([&](std::uint32_t i) { return joined_.find(i) == i || smooth_.find(i) == i; });
    const std::uint32_t largest = joined_.largest(execution_), largestSmooth = smooth_.largest(execution_);
    joinAllEdges([&](std::uint32_t i) {
      return joined_.find(i) != joined_.find(largest) || smooth_.find(i) != smooth_.find(largestSmooth);
    });
    return result();
  }

private:
  /// \return whether the angle between the normals is within the limit
  bool join(std::uint32_t i, std::uint32_t j)
  {
    const Eigen::Vector3f &a = normals_[i], &b = normals_[j];
    if (i == j || a.isZero() || b.isZero())
      return false;
    const Eigen::Vector3f edge = points_.positions[j] - points_.positions[i];
    const float alongA = edge.dot(a), alongB = edge.dot(b);
    const float along = alongNormals * alongNormals * edge.squaredNorm();
    const bool acrossSheets = alongA * alongA > along && alongB * alongB > along;
    const bool withinAngle = std::abs(a.dot(b)) >= minCosine_;
    if (withinAngle)
      smooth_.join(i, j);
    // An edge between two sheets joins the two sides of one object only for the outward vote.
    if (!acrossSheets && (withinAngle || options_.joinAcrossCreases))
      joined_.join(i, j);
    return withinAngle;
  }

  /// Joins each point to some of the next ones in memory.
  void joinFollowing()
  {
    constexpr std::size_t following = 8;
    constexpr int edgesToFollowing = 2; // more cost as much as they save
    const std::vector<Eigen::Vector3f>& positions = points_.positions;
    forEach(execution_, positions.size(), componentGrain, [&](std::size_t i) {
      int edges = 0;
      for (std::size_t j = i + 1; j < std::min(i + 1 + following, positions.size()) && edges < edgesToFollowing; ++j)
        if (reach_.joins(i, j, (positions[j] - positions[i]).squaredNorm()) &&
            join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j)))
          ++edges;
    });
    execution_.poll();
  }

  /// Visits all edges of the points that are still wanted at their turn; other threads' joins may make them unwanted.
  template <typename IsWanted>
  void joinAllEdges(const IsWanted& isWanted)
  {
    execution_.forRange(points_.size(), componentGrain, [&](std::uint32_t begin, std::uint32_t end) {
      Neighbors found;
      for (std::uint32_t i = begin; i < end; ++i)
        if (!normals_[i].isZero() && isWanted(i)) {
          search_.within(points_.positions[i], std::nextafter(reach_.of(i), std::numeric_limits<float>::max()), found);
          for (std::size_t n = 0; n < found.indices.size(); ++n)
            if (const auto j = static_cast<std::uint32_t>(found.indices[n]);
                reach_.joins(i, j, found.squaredDistances[n]))
              join(i, j);
        }
    });
    execution_.poll();
  }

  /// The number of points that have a normal and fulfill the condition.
  template <typename Condition>
  std::int64_t count(const Condition& condition)
  {
    return static_cast<std::int64_t>(
        sumOver<std::uint32_t>(execution_, points_.size(), componentGrain,
                               [&](std::uint32_t i) { return !normals_[i].isZero() && condition(i) ? 1. : 0.; }));
  }

  OrientationResult result()
  {
    OrientationResult result;
    result.keep.assign(points_.size(), 0);
    const auto sizes = joined_.sizes(execution_);
    const double smallest = options_.minComponentShare * static_cast<double>(points_.wholeSize());
    const std::int64_t kept = count([&](std::uint32_t i) {
      result.keep[i] = sizes[joined_.find(i)] >= smallest ? 1 : 0;
      return result.keep[i] != 0;
    });
    result.pointsDropped = static_cast<std::int64_t>(points_.size()) - kept;
    result.components = count([&](std::uint32_t i) { return joined_.find(i) == i; });
    result.componentsDropped = count([&](std::uint32_t i) { return joined_.find(i) == i && sizes[i] < smallest; });
    result.componentsAtCreases = count([&](std::uint32_t i) { return smooth_.find(i) == i; });
    return result;
  }

  const PointSet& points_;
  const std::vector<Eigen::Vector3f>& normals_;
  const NeighborSearch& search_;
  const Reach& reach_;
  const float minCosine_;
  const OrientationOptions& options_;
  Execution& execution_;
  DisjointSets joined_; ///< the components
  DisjointSets smooth_; ///< the components by edges within the angle only
};

/// Finds the signs of normals in phases. First, trees of the best edges make them consistent; an edge that contradicts
/// decisive votes of both its trees is left out. Then votes turn components, then smooth pieces of them.
class NormalOrienter {
public:
  NormalOrienter(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const NeighborSearch& search,
                 const Reach& reach, OrientationVote vote, const OrientationOptions& options, Execution& execution)
      : points_(points), normals_(normals), search_(search), reach_(reach), vote_(vote), options_(options),
        execution_(execution),
        piecesVote_(vote == OrientationVote::reference ||
                    (vote == OrientationVote::sensor && (!points.views.empty() || points.sensors.size() == 1))),
        smallest_(options.minComponentShare * static_cast<double>(points.wholeSize())), withinAngle_(points.size()),
        smooth_(piecesVote_ ? points.size() : 0)
  {}

  OrientationResult run()
  {
    SignedForest forest = growTree();
    const Partition components(points_.size(), [&](std::uint32_t i) { return forest.root(i); });
    countComponents(components);
    result_.normals = normals_;
    makeConsistent(components, forest);
    const Voters voters(points_, result_.normals, areas_, components, vote_);
    turnComponents(components, voters);
    if (piecesVote_)
      turnPieces(voters);
    measureAgreement(voters);
    return std::move(result_);
  }

private:
  /// The trees of the best edges. Also sets areas_, and joins withinAngle_ and smooth_.
  SignedForest growTree()
  {
    OrientationGraph graph(
        points_, normals_, search_, reach_, minCosineOf(options_),
        [&](const Edge& edge) {
          if (edge.withinAngle)
            withinAngle_.join(edge.a, edge.b);
          if (piecesVote_ && edge.quality >= smoothQuality)
            smooth_.join(edge.a, edge.b);
        },
        execution_);
    execution_.poll();
    const bool mayBeSides = options_.joinAcrossCreases && vote_ == OrientationVote::outward;
    FacingSides sides(points_, normals_, search_, reach_);
    std::vector<Votes> tallies = piecesVote_ ? votesOfPoints() : std::vector<Votes>();
    SignedForest forest = graph.bestTree(
        [&](const Edge& edge, SignedForest& trees) {
          // An edge between two sheets joins the two sides of one object only for the outward vote.
          const bool isUsed = edge.acrossSheets ? mayBeSides && std::min(trees.size(edge.a), trees.size(edge.b)) >=
                                                                    std::max(smallest_, smallestSide)
                                                : options_.joinAcrossCreases || edge.withinAngle;
          return isUsed && !(mayBeSides && sides.isBetween(edge, trees)) &&
                 (!piecesVote_ || joinVotes(edge, trees, tallies));
        },
        execution_);
    areas_ = graph.takeAreas();
    if (mayBeSides)
      sides.join(graph, areas_, forest);
    return forest;
  }

  std::vector<Votes> votesOfPoints() const
  {
    const Partition none(0, [](std::uint32_t i) { return i; });
    const Voters voters(points_, normals_, areas_, none, vote_);
    std::vector<Votes> tallies(points_.size());
    forEach(execution_, points_.size(), componentGrain, [&](std::size_t i) { tallies[i] = voters(i); });
    return tallies;
  }

  /// Adds up the votes of an edge's two trees. If decided votes of large trees contradict the edge, only returns false.
  static bool joinVotes(const Edge& edge, SignedForest& trees, std::vector<Votes>& tallies)
  {
    const std::uint32_t a = trees.root(edge.a), b = trees.root(edge.b);
    const double sign = trees.isFlipped(edge.a) ^ trees.isFlipped(edge.b) ^ edge.opposite ? -1 : 1;
    const Votes first = tallies[a], second = {sign * tallies[b].balance, tallies[b].total};
    if (trees.size(a) >= smallestVotingPiece && trees.size(b) >= smallestVotingPiece && first.isDecided() &&
        second.isDecided() && first.balance * second.balance < 0)
      return false;
    tallies[a] = {first.balance + second.balance, first.total + second.total};
    tallies[b] = {sign * tallies[a].balance, tallies[a].total};
    return true;
  }

  /// Counts the components, and drops the small ones.
  void countComponents(const Partition& components)
  {
    result_.keep.assign(points_.size(), 0);
    std::vector<std::uint8_t> seen(components.sizes.size(), 0);
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
      if (normals_[i].isZero())
        continue;
      const bool isKept = components.sizes[components.set[i]] >= smallest_;
      result_.keep[i] = isKept ? 1 : 0;
      if (components.isFirst(i, seen)) {
        ++result_.components;
        result_.componentsDropped += isKept ? 0 : 1;
      }
      result_.componentsAtCreases += withinAngle_.find(i) == i ? 1 : 0;
    }
    result_.pointsDropped = std::count(result_.keep.begin(), result_.keep.end(), std::uint8_t{0});
  }

  void turn(std::size_t i) { result_.normals[i] = -result_.normals[i]; }

  /// Makes each component consistent. Most of its normals keep their sign, so that the number of those that are turned
  /// means something if normals were given.
  void makeConsistent(const Partition& components, const SignedForest& forest)
  {
    std::vector<std::uint32_t> flipped(components.sizes.size(), 0);
    for (std::uint32_t i = 0; i < points_.size(); ++i)
      flipped[components.set[i]] += forest.isFlipped(i) ? 1 : 0;
    std::size_t turned = 0;
    for (std::uint32_t i = 0; i < points_.size(); ++i) {
      const std::uint32_t set = components.set[i];
      if (forest.isFlipped(i) != (2 * flipped[set] > components.sizes[set])) {
        turn(i);
        ++turned;
      }
    }
    result_.minorityShare = static_cast<double>(turned) / static_cast<double>(points_.size());
  }

  /// Turns components by the majority of their votes.
  void turnComponents(const Partition& components, const Voters& voters)
  {
    const std::vector<Votes> tallies = tally(components, voters);
    std::vector<std::uint8_t> isTurned(tallies.size());
    std::transform(tallies.begin(), tallies.end(), isTurned.begin(),
                   [](const Votes& own) { return own.balance < 0 ? std::uint8_t{1} : std::uint8_t{0}; });
    if (vote_ == OrientationVote::outward) {
      const Sides sides =
          chooseSides(points_, {result_.normals, areas_, components, isTurned}, reach_, search_, execution_);
      isTurned = sides.isTurned;
      result_.openShare = sides.openShare;
      result_.sideIsGuessed = sides.isGuess;
    }
    std::vector<std::uint8_t> seen(components.sizes.size(), 0);
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (isTurned[components.set[i]]) {
        turn(i);
        result_.componentsFlipped += components.isFirst(i, seen) && result_.keep[i];
      }
  }

  /// Turns smooth pieces that vote decidedly against their component's sign; in small pieces, points by their own vote.
  void turnPieces(const Voters& voters)
  {
    const Partition pieces(points_.size(), [&](std::uint32_t i) { return smooth_.find(i); });
    const std::vector<Votes> tallies = tally(pieces, voters);
    std::vector<std::uint8_t> seen(pieces.sizes.size(), 0);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const bool votes = pieces.sizes[pieces.set[i]] >= smallestVotingPiece;
      if (!(votes ? tallies[pieces.set[i]].isDecidedlyAgainst() : voters(i).balance < 0))
        continue;
      turn(i);
      result_.piecesFlipped += votes && pieces.isFirst(i, seen) && result_.keep[i];
    }
  }

  void measureAgreement(const Voters& voters)
  {
    double agreeing = 0, total = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (!result_.keep[i])
        continue;
      const Votes cast = voters(i);
      result_.pointsFlipped += result_.normals[i].dot(normals_[i]) < 0;
      agreeing += (cast.total + cast.balance) / 2;
      total += cast.total;
    }
    if (total > 0)
      result_.agreement = agreeing / total;
  }

  const PointSet& points_;
  const std::vector<Eigen::Vector3f>& normals_;
  const NeighborSearch& search_;
  const Reach& reach_;
  const OrientationVote vote_;
  const OrientationOptions& options_;
  Execution& execution_;
  const bool piecesVote_;    ///< the votes are good enough for smooth pieces to vote on their own
  const double smallest_;    ///< min points of a component that stays
  DisjointSets withinAngle_; ///< the paper's components
  DisjointSets smooth_;      ///< the pieces of smooth surface
  std::vector<float> areas_;
  OrientationResult result_;
};

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
  const Reach reach = reachOf(points, search, density, options, execution);
  if (vote == OrientationVote::none) {
    OrientationResult result = ComponentFinder(points, normals, search, reach, options, execution).run();
    result.normals = normals; // with the finder's sets out of memory
    return result;
  }
  return NormalOrienter(points, normals, search, reach, vote, options, execution).run();
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/components.h"

#include "base/disjoint_sets.h"
#include "base/loops.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pcl::mrf {
namespace {

/// Points per piece of parallel work.
constexpr std::int64_t componentGrain = 4096;

/// Joins points to components.
///
/// Edges may be looked at in any order, and need not be once both ends are in one component. Those to the next
/// points in memory, close by in space, make pieces of some twenty points. All edges of each piece's first point join
/// nearly all of them to one component. An edge between two components ends at a point outside of the largest one, so
/// looking at all edges of those finds the rest.
class ComponentFinder {
public:
  ComponentFinder(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const NeighborSearch& search,
                  const Reach& reach, float minCosine, const OrientationOptions& options, Execution& execution)
      : points_(points), normals_(normals), search_(search), reach_(reach), minCosine_(minCosine), options_(options),
        execution_(execution), joined_(points.size()), smooth_(points.size())
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
  /// \return whether the normals of both agree
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
    // Without a vote from outside, two sheets can only be taken for the two sides of one object.
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

  /// Other threads' joins may make a point unwanted just before its turn: then its edges are known.
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

  /// The number of points with a normal that a condition holds for.
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
  DisjointSets smooth_; ///< those within the angle
};

} // namespace

OrientationResult findComponents(const PointSet& points, const std::vector<Eigen::Vector3f>& normals,
                                 const NeighborSearch& search, const Reach& reach, float minCosine,
                                 const OrientationOptions& options, Execution& execution)
{
  OrientationResult result = ComponentFinder(points, normals, search, reach, minCosine, options, execution).run();
  result.normals = normals; // with the finder's sets out of memory
  return result;
}

} // namespace pcl::mrf

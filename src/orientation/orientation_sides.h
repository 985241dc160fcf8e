// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Which side of a surface is its outside, when nobody says so.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include "orientation/orientation_graph.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace pcl {
namespace mrf {

/// A partition of the points: the set of each, numbered by their smallest elements.
struct Partition {
  std::vector<std::uint32_t> set;
  std::vector<std::uint32_t> sizes; ///< per set

  /// \param root the same for all elements of a set, some element of it
  template <typename Root>
  Partition(std::size_t count, const Root& root) : set(count)
  {
    constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> numbers(count, none); // at the roots
    for (std::uint32_t i = 0; i < count; ++i) {
      std::uint32_t& number = numbers[root(i)];
      if (number == none) {
        number = static_cast<std::uint32_t>(sizes.size());
        sizes.push_back(0);
      }
      set[i] = number;
      ++sizes[number];
    }
  }

  /// Whether i is the smallest element of its set.
  bool isFirst(std::size_t i, std::vector<std::uint8_t>& seen) const
  {
    return std::exchange(seen[set[i]], std::uint8_t{1}) == 0;
  }
};

/// Which components of consistent normals are to be turned.
struct Sides {
  std::vector<std::uint8_t> isTurned; ///< one flag per component
  double openShare = 0;               ///< of the surface, in components that enclose no volume
  bool isGuess = false;               ///< more than a twentieth of the surface is open
};

/// Chooses as OrientationVote::outward says.
/// \param normals consistent inside each component
/// \param areas that the points stand for, up to one common factor
/// \param isTurnedOutward per component: whether its own outward vote turns it
Sides chooseSides(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const std::vector<float>& areas,
                  const Partition& components, const std::vector<std::uint8_t>& isTurnedOutward, const Reach& reach,
                  const NeighborSearch& search, Execution& execution);

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
#include "points/near_copies.h"

#include "base/loops.h"
#include "base/select_values.h"

#include <algorithm>
#include <cmath>

namespace pcl::mrf {
namespace {

constexpr int maxCopies = 256;

/// Min ratio of the distances of the 2k-th and the k-th neighbor across a gap, squared. Without one the ratio is 1.4 on
/// surfaces and 2 on curves.
constexpr float gap = 9;

/// Whether groups of k points lie on a surface. Small objects that are apart from each other have gaps as well.
bool areOnSurface(const std::vector<Eigen::Vector3f>& positions, std::size_t copies, const NeighborSearch& search)
{
  constexpr std::size_t asked = 16, few = 16, many = 128; // places, groups around them
  // Of the distances within which so many groups are, squared: 8 on surfaces, 4 where groups fill a volume.
  constexpr float minRatio = 5;
  if (positions.size() <= many * copies)
    return false;
  std::vector<float> ratios;
  Neighbors found;
  for (const std::uint32_t i : spreadIndices(positions.size(), asked)) {
    search.nearest(positions[i], static_cast<int>(many * copies) + 1, found);
    ratios.push_back(found.squaredDistances.back() / found.squaredDistances[few * copies]);
  }
  return median(std::move(ratios)) > minRatio;
}

} // namespace

int countNearCopies(const std::vector<Eigen::Vector3f>& positions, const NeighborSearch& search)
{
  constexpr std::size_t minPoints = 1024, asked = 64;
  if (positions.size() < minPoints)
    return 0;
  std::vector<Neighbors> neighbors(asked);
  for (std::size_t n = 0; n < asked; ++n)
    search.nearest(positions[n * positions.size() / asked], 2 * maxCopies + 1, neighbors[n]);
  for (int copies = maxCopies; copies > 0; copies /= 2) {
    std::vector<float> ratios;
    for (const Neighbors& found : neighbors) {
      const std::vector<float>& squared = found.squaredDistances;
      ratios.push_back(squared[copies] > 0 ? squared[2 * copies] / squared[copies] : 0);
    }
    if (median(std::move(ratios)) > gap)
      return areOnSurface(positions, copies, search) ? copies : 0;
  }
  return 0;
}

std::int64_t dropNearCopies(const PointArrays& points, const NeighborSearch& search, int copies,
                            std::vector<std::uint8_t>& keep, Execution& execution)
{
  const std::vector<Eigen::Vector3f>& positions = points.positions;
  std::vector<std::uint8_t> isTaken(positions.size(), 0);
  std::int64_t dropped = 0;
  Neighbors found, group;
  Poller poll(execution);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    poll();
    if (isTaken[i])
      continue;
    search.nearest(positions[i], 2 * copies + 1, found);
    // The middle of the gap.
    const float inside = found.squaredDistances[copies], beyond = found.squaredDistances.back();
    search.within(positions[i], std::sqrt(std::sqrt(inside) * std::sqrt(beyond)), group);
    std::vector<int>& members = group.indices;
    const auto isOther = [&](int member) {
      return isTaken[member] != 0 || (!points.normals.empty() && points.normals[i].dot(points.normals[member]) < 0);
    };
    members.erase(std::remove_if(members.begin(), members.end(), isOther), members.end());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int member : members)
      sum += positions[member].cast<double>();
    const Eigen::Vector3f mean = (sum / static_cast<double>(members.size())).cast<float>();
    const int middle = *std::min_element(members.begin(), members.end(), [&](int a, int b) {
      return (positions[a] - mean).squaredNorm() < (positions[b] - mean).squaredNorm();
    });
    for (const int member : members) {
      isTaken[member] = 1;
      if (member != middle && keep[member]) {
        keep[member] = 0;
        ++dropped;
      }
    }
  }
  return dropped;
}

} // namespace pcl::mrf

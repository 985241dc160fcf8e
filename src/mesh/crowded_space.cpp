// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/crowded_space.h"

#include "base/loops.h"

#include <pcl/surface/mrf/point_set.h>

#include <algorithm>
#include <array>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

/// Cosine of 30°: max angle between a normal and its cell's mean, and between that and the mean of the cells around it.
constexpr float minCosine = .8660254f;

} // namespace

CrowdedSpace::CrowdedSpace(const std::vector<Vector3f>& positions, const std::vector<Vector3f>& normals, float side,
                           Execution& execution)
    : hash_(boundingBox(positions).lower.cast<double>(), side)
{
  std::vector<std::uint32_t> cellOf(positions.size());
  Poller poll(execution);
  for (std::size_t v = 0; v < positions.size(); ++v) {
    poll();
    cellOf[v] = hash_.add(hash_.cellOf(positions[v]));
    cells_.resize(hash_.size());
    cells_[cellOf[v]].axis += normals[v];
  }
  for (Cell& cell : cells_)
    cell.axis.normalize();
  for (std::size_t v = 0; v < positions.size(); ++v) {
    Cell& cell = cells_[cellOf[v]];
    cell.cosine = std::min(cell.cosine, normals[v].dot(cell.axis));
  }
  forEachPolling(execution, cells_.size(), 4096,
                 [&](std::size_t n) { cells_[n].isCrowded = isCrowdedAround(hash_[n]); });
}

bool CrowdedSpace::contains(const Vector3f& position) const
{
  const CellHash::Cell place = hash_.cellOf(position);
  const std::uint32_t cell = hash_.find(place);
  return cell == CellHash::none ? isCrowdedAround(place) : cells_[cell].isCrowded;
}

bool CrowdedSpace::isCrowdedAround(const CellHash::Cell& place) const
{
  std::array<const Cell*, 27> around;
  std::size_t count = 0;
  Vector3f sum = Vector3f::Zero();
  CellHash::forEachAround(place, [&](const CellHash::Cell& neighbor) {
    const std::uint32_t cell = hash_.find(neighbor);
    if (cell == CellHash::none)
      return;
    around[count++] = &cells_[cell];
    sum += cells_[cell].axis;
  });
  const Vector3f axis = sum.normalized();
  return !std::all_of(around.begin(), around.begin() + count,
                      [&](const Cell* cell) { return cell->cosine >= minCosine && cell->axis.dot(axis) >= minCosine; });
}

} // namespace pcl::mrf

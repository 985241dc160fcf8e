// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/crowded_space.h"

#include "base/polling.h"

#include <algorithm>
#include <array>

namespace pcl {
namespace mrf {
namespace {

using Eigen::Vector3f;

/// Of the angles between a normal and its cell's mean, and between that and its neighborhood's: together 60° at most.
constexpr float minCosine = .8660254f;

} // namespace

CrowdedSpace::CrowdedSpace(const std::vector<Vector3f>& positions, const std::vector<Vector3f>& normals, float side,
                           Execution& execution)
    : side_(side)
{
  Vector3f lower = Vector3f::Zero();
  for (const Vector3f& p : positions)
    lower = lower.cwiseMin(p);
  origin_ = lower.cast<double>().array();
  std::size_t count = 2;
  while (count < 2 * positions.size())
    count *= 2;
  slots_.assign(count, none);

  std::vector<std::uint32_t> cellOf(positions.size());
  Poller poll(execution);
  for (std::size_t v = 0; v < positions.size(); ++v) {
    poll();
    const Key key = keyOf(indexOf(positions[v]));
    std::uint32_t& cell = slots_[slotOf(key)];
    if (cell == none) {
      cell = static_cast<std::uint32_t>(cells_.size());
      cells_.emplace_back();
      cells_.back().key = key;
    }
    cellOf[v] = cell;
    cells_[cell].axis += normals[v];
  }
  for (Cell& cell : cells_)
    cell.axis.normalize();
  for (std::size_t v = 0; v < positions.size(); ++v) {
    Cell& cell = cells_[cellOf[v]];
    cell.cosine = std::min(cell.cosine, normals[v].dot(cell.axis));
  }
  forRangePolling(execution, static_cast<std::int64_t>(cells_.size()), 4096, [&](std::int64_t begin, std::int64_t end) {
    const Key mask = (Key{1} << bits) - 1;
    for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n) {
      const Key key = cells_[n].key;
      cells_[n].isCrowded =
          isCrowdedAround(Index(static_cast<std::int64_t>(key & mask), static_cast<std::int64_t>(key >> bits & mask),
                                static_cast<std::int64_t>(key >> 2 * bits)));
    }
  });
}

bool CrowdedSpace::contains(const Vector3f& position) const
{
  const Index index = indexOf(position);
  const std::uint32_t cell = slots_[slotOf(keyOf(index))];
  return cell == none ? isCrowdedAround(index) : cells_[cell].isCrowded;
}

/// Far cells share an index: they look crowded, no more.
CrowdedSpace::Index CrowdedSpace::indexOf(const Vector3f& position) const
{
  const double last = static_cast<double>((std::int64_t{1} << bits) - 1);
  const Eigen::Array3d cell = ((position.cast<double>().array() - origin_) / side_).floor();
  return cell.max(0).min(last).cast<std::int64_t>();
}

CrowdedSpace::Key CrowdedSpace::keyOf(const Index& index)
{
  return static_cast<Key>(index.x()) | static_cast<Key>(index.y()) << bits | static_cast<Key>(index.z()) << 2 * bits;
}

std::size_t CrowdedSpace::slotOf(Key key) const
{
  const std::size_t mask = slots_.size() - 1;
  auto slot = static_cast<std::size_t>(key * 0x9e3779b97f4a7c15ull >> 24) & mask;
  while (slots_[slot] != none && cells_[slots_[slot]].key != key)
    slot = (slot + 1) & mask;
  return slot;
}

bool CrowdedSpace::isCrowdedAround(const Index& index) const
{
  std::array<const Cell*, 27> around;
  std::size_t count = 0;
  Vector3f sum = Vector3f::Zero();
  for (std::int64_t n = 0; n < 27; ++n) {
    const Index neighbor = index + Index(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    if ((neighbor < 0).any() || (neighbor >= std::int64_t{1} << bits).any())
      continue;
    const std::uint32_t cell = slots_[slotOf(keyOf(neighbor))];
    if (cell == none)
      continue;
    around[count++] = &cells_[cell];
    sum += cells_[cell].axis;
  }
  const Vector3f axis = sum.normalized();
  return !std::all_of(around.begin(), around.begin() + static_cast<std::ptrdiff_t>(count),
                      [&](const Cell* cell) { return cell->cosine >= minCosine && cell->axis.dot(axis) >= minCosine; });
}

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
#include "point_grid.h"

#include "random.h"

#include <shapes/portable_math.h>

#include <cmath>
#include <limits>

namespace pcl {
namespace mrf {
namespace scan {

using Eigen::Vector3d;

PointGrid::PointGrid(double side, std::size_t expected) : side_(side), slots_(1024, Slot{0, -1})
{
  points_.reserve(expected);
}

PointGrid::Cell PointGrid::cellOf(const Vector3d& position) const
{
  Cell cell;
  for (int axis = 0; axis < 3; ++axis)
    cell[axis] = static_cast<std::int64_t>(std::floor(position[axis] / side_));
  return cell;
}

std::uint64_t PointGrid::keyOf(const Cell& cell)
{
  // 21 bits per axis: cells that are 2 million apart share a list, which costs time only.
  const std::uint64_t mask = (1u << 21) - 1;
  const auto bits = [&](int axis) { return static_cast<std::uint64_t>(cell[axis]) & mask; };
  return bits(0) | bits(1) << 21 | bits(2) << 42;
}

std::size_t PointGrid::slotOf(std::uint64_t key) const
{
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = static_cast<std::size_t>(mix(key)) & mask;
  while (slots_[slot].first >= 0 && slots_[slot].key != key)
    slot = (slot + 1) & mask;
  return slot;
}

void PointGrid::grow()
{
  std::vector<Slot> old(2 * slots_.size(), Slot{0, -1});
  old.swap(slots_);
  for (const Slot& slot : old)
    if (slot.first >= 0)
      slots_[slotOf(slot.key)] = slot;
}

void PointGrid::add(const Vector3d& position, const Vector3d& normal)
{
  const Cell cell = cellOf(position);
  lower_ = points_.empty() ? cell : Cell(lower_.cwiseMin(cell));
  upper_ = points_.empty() ? cell : Cell(upper_.cwiseMax(cell));
  const std::uint64_t key = keyOf(cell);
  Slot& slot = slots_[slotOf(key)];
  if (slot.first < 0)
    ++used_;
  points_.push_back({position, normal, slot.first});
  slot = {key, static_cast<std::int64_t>(points_.size()) - 1};
  if (2 * used_ > slots_.size())
    grow();
}

bool PointGrid::hasWithin(const Vector3d& position, const Vector3d& normal, double radius) const
{
  const Cell lower = cellOf(position - Vector3d::Constant(radius)),
             upper = cellOf(position + Vector3d::Constant(radius));
  for (std::int64_t z = lower.z(); z <= upper.z(); ++z)
    for (std::int64_t y = lower.y(); y <= upper.y(); ++y)
      for (std::int64_t x = lower.x(); x <= upper.x(); ++x)
        for (std::int64_t i = firstIn({x, y, z}); i >= 0; i = points_[static_cast<std::size_t>(i)].next) {
          const Point& other = points_[static_cast<std::size_t>(i)];
          const Vector3d apart = other.position - position;
          if (portable::dot(apart, apart) < radius * radius && portable::dot(other.normal, normal) > 0)
            return true;
        }
  return false;
}

double PointGrid::nearestOther(std::size_t i) const
{
  const Vector3d& position = points_[i].position;
  const Cell center = cellOf(position);
  const std::int64_t farthest = std::max((center - lower_).maxCoeff(), (upper_ - center).maxCoeff());
  double best = std::numeric_limits<double>::infinity();
  // Shells of cells; what is not in the first `shell` of them is farther than that many sides.
  for (std::int64_t shell = 0; shell <= farthest && best > static_cast<double>(shell - 1) * side_; ++shell)
    for (std::int64_t z = -shell; z <= shell; ++z)
      for (std::int64_t y = -shell; y <= shell; ++y) {
        const bool isWall = std::abs(z) == shell || std::abs(y) == shell;
        for (std::int64_t x = -shell; x <= shell; x += isWall || shell == 0 ? 1 : 2 * shell)
          for (std::int64_t j = firstIn(center + Cell(x, y, z)); j >= 0;
               j = points_[static_cast<std::size_t>(j)].next) {
            const double distance = portable::norm(points_[static_cast<std::size_t>(j)].position - position);
            if (distance > 0 && distance < best)
              best = distance;
          }
      }
  return best;
}

} // namespace scan
} // namespace mrf
} // namespace pcl

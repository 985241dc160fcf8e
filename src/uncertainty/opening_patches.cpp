// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/opening_patches.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

namespace pcl::mrf {
namespace {

/// Radii of the discs, in radii of the widest opening.
constexpr float radii[] = {1, .71f, .5f};

/// For each radius: maximum number of discs, maximum share of the points in them, and number of places that are tried.
constexpr std::size_t maxPatches = 16;
constexpr double maxShareOfPoints = 1. / 36;
constexpr int attempts = 160;

/// Minimum distance between discs, and from a disc's center to openings, in radii (of two discs: in their sum).
constexpr float apart = 1.3f;

/// The points within the radius of a point that are on its sheet. Points that face away are on another sheet.
std::vector<std::uint32_t> pointsOfDisc(const OrientedPoints& points, const NeighborSearch& search, std::size_t center,
                                        float radius, Neighbors& found)
{
  std::vector<std::uint32_t> inside;
  search.within(points.positions[center], radius, found);
  for (const int i : found.indices)
    if (points.normals[i].dot(points.normals[center]) > 0)
      inside.push_back(static_cast<std::uint32_t>(i));
  return inside;
}

} // namespace

std::vector<Patch> choosePatches(const OrientedPoints& points, const NeighborSearch& search, const Openings& openings,
                                 float narrowest, Execution& execution)
{
  std::vector<Patch> patches;
  if (openings.vertices.empty() || points.size() == 0)
    return patches;
  const std::unique_ptr<NeighborSearch> nearOpenings = makePointBins();
  nearOpenings->setPoints(openings.vertices, execution);
  const auto max = static_cast<std::size_t>(maxShareOfPoints * static_cast<double>(points.size()));
  std::mt19937 random(1);
  Neighbors found;
  float last = 0;
  for (const float share : radii) {
    const float radius = std::max(share * openings.largest, narrowest);
    if (radius == last)
      break;
    last = radius;
    std::size_t left = max, count = 0;
    const auto isFree = [&](const Eigen::Vector3f& center) {
      nearOpenings->nearest(center, 1, found);
      return std::sqrt(found.squaredDistances.front()) > apart * radius &&
             std::all_of(patches.begin(), patches.end(), [&](const Patch& other) {
               return (other.center - center).norm() > apart * (radius + other.radius);
             });
    };
    for (int attempt = 0; attempt < attempts && count < maxPatches; ++attempt) {
      const std::size_t center = random() % points.size();
      if (!isFree(points.positions[center]))
        continue;
      std::vector<std::uint32_t> inside = pointsOfDisc(points, search, center, radius, found);
      if (inside.size() > left)
        continue;
      left -= inside.size();
      ++count;
      patches.push_back({points.positions[center], radius, std::move(inside)});
    }
    execution.poll();
  }
  return patches;
}

} // namespace pcl::mrf

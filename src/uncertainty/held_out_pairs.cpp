// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/held_out_pairs.h"

#include "base/loops.h"
#include "base/random.h"
#include "field/field_sampler.h"
#include "solver/grids.h"

#include <pcl/surface/mrf/distance_field.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <random>
#include <set>

namespace pcl::mrf {
namespace {

constexpr std::size_t maxBalls = 24;
constexpr int attempts = 8;          ///< candidate centers per ball
constexpr double ballRadius = 11;    ///< voxels
constexpr double margin = 3;         ///< voxels at a ball's rim where the field differs from the whole cloud's
constexpr std::size_t pairEach = 20; ///< one of so many points begins a pair

/// Centers of balls that do not overlap much.
std::vector<Eigen::Vector3f> spreadCenters(const std::vector<Eigen::Vector3f>& positions, double distance)
{
  std::mt19937 random(2);
  std::vector<Eigen::Vector3f> centers;
  for (std::size_t n = 0; n < attempts * maxBalls && centers.size() < maxBalls; ++n) {
    const Eigen::Vector3f& candidate = positions[random() % positions.size()];
    if (std::all_of(centers.begin(), centers.end(),
                    [&](const Eigen::Vector3f& other) { return (other - candidate).norm() > distance; }))
      centers.push_back(candidate);
  }
  return centers;
}

/// A ball: its points without the held-out ones, and the held-out pairs.
class Ball {
public:
  Ball(const OrientedPoints& points, const NeighborSearch& search, const Eigen::Vector3f& center, double voxelSize)
  {
    Neighbors found;
    search.within(center, static_cast<float>(ballRadius * voxelSize), found);
    std::vector<std::size_t> inside(found.indices.begin(), found.indices.end());
    std::sort(inside.begin(), inside.end());
    const double core = (ballRadius - margin) * voxelSize;
    std::set<std::size_t> withheld;
    for (const std::size_t i : inside) {
      if (indexHash(i) % pairEach != 0 || (points.positions[i] - center).norm() > core || withheld.count(i) != 0)
        continue;
      const std::size_t other = besides(i, points, search, found);
      if (other == i || withheld.count(other) != 0 || (points.positions[other] - center).norm() > core)
        continue;
      withheld.insert({i, other});
      pairs_.emplace_back(points.positions[i], points.positions[other]);
    }
    std::vector<std::uint32_t> seen;
    for (const std::size_t i : inside)
      if (withheld.count(i) == 0)
        seen.push_back(static_cast<std::uint32_t>(i));
    seen_ = select(points, seen);
  }

  std::vector<HeldOutPair> solve(float spacing, const ResolvedOptions& options) const
  {
    std::vector<HeldOutPair> result;
    if (pairs_.empty() || seen_.size() == 0)
      return result;
    constexpr double tolerance = 1e-2;
    const Prior prior = options.prior.kind;
    Execution serial(1);
    const Lattice lattice = latticeAround(options.multiscale.voxelSize);
    const WholeLevel level({lattice}, toSamples({seen_, lattice, spacing}, serial),
                           levelWeights(prior, options.observation, spacing, lattice.spacing, true), prior, serial);
    std::vector<float> values(lattice.size.count(), 0);
    level.solve(roughSolver(prior, tolerance), values, serial);
    const DistanceField field(lattice, std::move(values), {});
    Eigen::Vector3f gradient;
    const auto residual = [&](const Eigen::Vector3f& at) {
      const float distance = field.sampleDistance(at, gradient);
      return distance / slopeWithin(heldOutSlope, gradient);
    };
    for (const auto& [first, second] : pairs_) {
      const float ofSecond = residual(second), ofFirst = residual(first);
      result.push_back({first - ofFirst * gradient.normalized(), ofFirst, ofSecond});
    }
    return result;
  }

private:
  /// The nearest point in the tangent plane of a point: the nearest one in space of a noisy cloud has about the same
  /// noise.
  static std::size_t besides(std::size_t i, const OrientedPoints& points, const NeighborSearch& search,
                             Neighbors& found)
  {
    constexpr int asked = 64; // under noise of two spacings, the nearest 16 still share it
    search.nearest(points.positions[i], asked, found);
    // On a lattice several points are equally near, and the search lists the one with about the same noise first.
    std::sort(found.indices.begin(), found.indices.end());
    std::size_t best = i;
    float min = std::numeric_limits<float>::infinity();
    for (const int j : found.indices) {
      const Eigen::Vector3f to = points.positions[j] - points.positions[i];
      const float along = points.normals[i].dot(to), squared = to.squaredNorm() - along * along;
      const bool isSameSheet = points.normals[j].dot(points.normals[i]) > 0;
      if (static_cast<std::size_t>(j) != i && isSameSheet && squared < min) {
        min = squared;
        best = static_cast<std::size_t>(j);
      }
    }
    return best;
  }

  Lattice latticeAround(double voxelSize) const
  {
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& p : seen_.positions)
      box.extend(p);
    for (const auto& [first, second] : pairs_) {
      box.extend(first);
      box.extend(second);
    }
    const Eigen::Array3i size =
        (box.sizes().cast<double>().array() / voxelSize).ceil().cast<int>() + static_cast<int>(2 * margin) + 1;
    return {{size.x(), size.y(), size.z()},
            box.min().cast<double>() - Eigen::Vector3d::Constant(margin * voxelSize),
            voxelSize};
  }

  OrientedPoints seen_;
  std::vector<std::pair<Eigen::Vector3f, Eigen::Vector3f>> pairs_;
};

} // namespace

std::vector<HeldOutPair> holdOutPairs(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                                      const ResolvedOptions& options, Execution& execution)
{
  const double voxelSize = options.multiscale.voxelSize;
  const std::vector<Eigen::Vector3f> centers = spreadCenters(points.positions, 2 * (ballRadius - margin) * voxelSize);
  std::vector<std::vector<HeldOutPair>> ofBalls(centers.size());
  forEach(execution, centers.size(), 1,
          [&](std::size_t n) { ofBalls[n] = Ball(points, search, centers[n], voxelSize).solve(spacing, options); });
  execution.poll();
  return joined(std::move(ofBalls));
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "support/shapes.h"
#include "support/clouds.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <tuple>

namespace shapes {

using Eigen::Vector3d;
using Eigen::Vector3f;

pcl::mrf::PointSet sample(const Sdf& sdf, double halfSide, double spacing, unsigned seed)
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> jitter(-.5, .5);
  const double side = .55 * spacing; // denser than wanted, so that the points are even after thinning
  const int n = static_cast<int>(std::ceil(halfSide / side));

  std::vector<Vector3d> candidates;
  for (int k = -n; k <= n; ++k)
    for (int j = -n; j <= n; ++j)
      for (int i = -n; i <= n; ++i) {
        Vector3d x = side * Vector3d(i, j, k);
        if (std::abs(sdf(x)) > side)
          continue;
        x += side * Vector3d(jitter(random), jitter(random), jitter(random));
        for (int step = 0; step < 3; ++step)
          x -= sdf(x) * normalOf(sdf, x);
        if (std::abs(sdf(x)) < 1e-9 * halfSide && x.cwiseAbs().maxCoeff() <= halfSide)
          candidates.push_back(x);
      }
  std::shuffle(candidates.begin(), candidates.end(), random);

  const double closest = .7 * spacing;
  std::map<std::tuple<int, int, int>, std::vector<Vector3d>> cells;
  const auto cellOf = [&](const Vector3d& x, int axis) { return static_cast<int>(std::floor(x[axis] / closest)); };
  pcl::mrf::PointSet points;
  for (const Vector3d& x : candidates) {
    const int ci = cellOf(x, 0), cj = cellOf(x, 1), ck = cellOf(x, 2);
    bool isFree = true;
    for (int k = ck - 1; isFree && k <= ck + 1; ++k)
      for (int j = cj - 1; isFree && j <= cj + 1; ++j)
        for (int i = ci - 1; isFree && i <= ci + 1; ++i) {
          const auto cell = cells.find({i, j, k});
          if (cell != cells.end())
            for (const Vector3d& other : cell->second)
              isFree = isFree && (other - x).squaredNorm() >= closest * closest;
        }
    if (!isFree)
      continue;
    cells[{ci, cj, ck}].push_back(x);
    clouds::append(points, x.cast<float>(), normalOf(sdf, x).cast<float>());
  }
  return points;
}

pcl::mrf::PointSet filter(const pcl::mrf::PointSet& points, const std::function<bool(const Vector3f& position)>& inside)
{
  std::vector<std::uint8_t> keep;
  for (const Vector3f& position : points.positions)
    keep.push_back(inside(position) ? 1 : 0);
  return pcl::mrf::select(points, keep);
}

void addNoise(pcl::mrf::PointSet& points, double sigma, unsigned seed)
{
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, static_cast<float>(sigma));
  for (std::size_t i = 0; i < points.size(); ++i)
    points.positions[i] += noise(random) * points.normals[i];
}

pcl::mrf::OrientedPoints oriented(const pcl::mrf::PointSet& points)
{
  pcl::mrf::OrientedPoints result;
  result.positions = points.positions;
  result.normals = points.normals;
  result.confidences = points.confidences;
  result.origins = points.origins;
  result.offset = points.offset;
  return result;
}

pcl::mrf::DistanceField field(const Sdf& sdf, double halfSide, int voxels)
{
  const double spacing = 2 * halfSide / voxels;
  const pcl::mrf::Lattice lattice{{voxels, voxels, voxels}, Vector3d::Constant(-halfSide + spacing / 2), spacing};
  std::vector<float> distances;
  forVoxels(lattice.size, [&](int x, int y, int z) {
    distances.push_back(static_cast<float>(sdf(lattice.origin + lattice.spacing * Vector3d(x, y, z))));
  });
  std::vector<float> confidences(distances.size(), 1.0f);
  return {lattice, std::move(distances), std::move(confidences)};
}

} // namespace shapes

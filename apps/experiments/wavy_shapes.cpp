// SPDX-License-Identifier: BSD-3-Clause
#include "wavy_shapes.h"
#include "figure_support.h"
#include "mesh/polygonizer.h"

#include <shapes/portable_math.h>
#include <shapes/signed_distance.h>

namespace mrf_apps {

using Eigen::Vector3d;
using pcl::mrf::Execution;

namespace {

/// \param length of the waves along each axis, \param height of them, cloud's unit
shapes::Sdf withWaves(const shapes::Sdf& shape, double height, double length)
{
  return [=](const Vector3d& x) {
    double wave = 1;
    // Phases that are no simple fractions: no plane of symmetry of the shape is one of the waves.
    for (int axis = 0; axis < 3; ++axis)
      wave *= portable::sinCos(x[axis] / length + .17 * (axis + 1)).sine;
    return shape(x) + height * wave;
  };
}

/// The zero level on a lattice that is finer than what scans resolve. \param half sides of a box around the shape
SurfaceMesh surfaceOf(const shapes::Sdf& shape, const Vector3d& half, Execution& execution)
{
  constexpr int voxels = 160;
  pcl::mrf::Lattice lattice;
  lattice.spacing = 2 * half.maxCoeff() / voxels;
  const Eigen::Vector3i size = (2 / lattice.spacing * half).array().ceil().cast<int>() + 1;
  lattice.size = {size.x(), size.y(), size.z()};
  // The middles of the voxels shall not lie on planes of symmetry, where distances of exactly zero are likely.
  lattice.origin = -half + Vector3d(.31, .27, .23) * lattice.spacing;
  std::vector<float> distances(static_cast<std::size_t>(lattice.size.count()));
  execution.forRange(lattice.size.z, 1, [&](std::int64_t begin, std::int64_t end) {
    for (auto k = static_cast<int>(begin); k < end; ++k)
      for (int j = 0; j < lattice.size.y; ++j)
        for (int i = 0; i < lattice.size.x; ++i)
          distances[static_cast<std::size_t>(lattice.size.index(i, j, k))] =
              static_cast<float>(shape(lattice.origin + lattice.spacing * Vector3d(i, j, k)));
  });
  const pcl::mrf::DistanceField field(lattice, std::move(distances), {});
  return figures::toSurfaceMesh(pcl::mrf::polygonize(field, {}, execution), Vector3d::Zero());
}

} // namespace

SurfaceMesh wavyTorus(Execution& execution)
{
  return surfaceOf(withWaves(shapes::torus(1, .42), waveHeight, 1), {1.55, 1.55, .55}, execution);
}

SurfaceMesh wavyBox(Execution& execution)
{
  return surfaceOf(withWaves(shapes::box({1, .75, .5}, .2), waveHeight, .7), {1.1, .85, .6}, execution);
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// What the levels of the multiscale scheme take and may take, before anything of them is allocated.
#pragma once

#include "levels/multiscale.h"

#include <pcl/surface/mrf/options.h>

namespace pcl::mrf {

/// Peak bytes of a finest level in a band: whole, or in tiles. \param unknowns, points of it \param planes of its grid
/// across z \param tiles 1: whole
double finestBandBytes(double unknowns, double points, int planes, int tiles);

/// Tiles beyond which more of them save little: they are as thick as the planes that are solved with them.
int mostTiles(int planes);

/// That of a cloud observed at its points, with the solver to be set. \param spacing l̄, cloud's unit
Workload workloadOf(std::size_t points, float spacing, const PriorOptions& prior);

/// Whether a finest level can be solved in tiles: points are observed, and a single step is taken.
/// \param bands up to it, of which it is not the first
bool mayBeTiled(const Workload& workload, int bands);

/// Peak bytes of solving a box with voxels of this side at the finest level, beside what is held before; infinite if it
/// has too many voxels to be counted. Parameters as for planLevels; the options' denseVoxels decide between dense
/// levels and bands.
double predictedBytes(const BoundingBox& box, double side, const Workload& workload, const MultiscaleOptions& options,
                      int threads);

/// \throw ResourceLimit if a box of this size cannot be solved within the limit by one thread, or cannot be left while
/// it is factorized
void checkResources(const BoundingBox& box, float voxelSize, const Workload& workload,
                    const MultiscaleOptions& options);

/// \throw ResourceLimit if ICM or conjugate gradients would take very long for a volume that hardly holds points
void checkTime(const GridSize& finest, const Workload& workload);

/// \param unknowns of the finest level, as a coarser one in a band foretells them from the surface that it has found
/// \param bytes that they take \throw ResourceLimit if these are above the limit, or the unknowns out of proportion to
/// the points
void checkSurface(double unknowns, double bytes, std::size_t points, double voxelSize, double limit);

} // namespace pcl::mrf

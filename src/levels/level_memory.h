// SPDX-License-Identifier: BSD-3-Clause
/// The memory and the time that the levels of the multiscale scheme take and may take, before they are allocated.
#pragma once

#include "levels/multiscale.h"

#include <pcl/surface/mrf/options.h>

namespace pcl::mrf {

/// Peak bytes of solving the finest level in a band. \param size of the grid, in the stored axes \param unknowns their
/// number \param tiles 1: the level is solved as a whole
double finestBandBytes(const GridSize& size, double unknowns, const Workload& workload, int tiles, int threads);

/// Max number of tiles: more save little, as they would be thinner than the halos that are solved with each.
int maxTiles(int planes);

/// The workload of a cloud observed at its points; the caller sets the solver. \param spacing l̄, cloud's unit
Workload workloadOf(std::size_t points, float spacing, const PriorOptions& prior);

/// True if the finest level can be solved in tiles: points are observed, it takes a single step, and it is not the
/// first level in a band. \param bands number of levels in bands
bool mayBeTiled(const Workload& workload, int bands);

/// Max number of voxels of a dense level: all levels are dense for the solvers and the energy that bands do not
/// support.
std::int64_t maxDenseVoxels(const MultiscaleOptions& options, const Workload& workload);

/// Peak bytes of solving a box with voxels of this side at the finest level, besides what is held before; infinite for
/// too many voxels. Parameters as for planLevels.
double predictedBytes(const BoundingBox& box, double side, const Workload& workload, const MultiscaleOptions& options,
                      int threads);

/// \throw ResourceLimit if solving the box on one thread takes more memory than the limit, or factorizing it more than
/// maxCholeskySeconds, in which the run cannot be cancelled
void checkResources(const BoundingBox& box, float voxelSize, const Workload& workload,
                    const MultiscaleOptions& options);

/// \throw ResourceLimit if ICM or conjugate gradients would take very long for a volume with few points
void checkTime(const GridSize& finest, const Workload& workload);

/// \param unknowns of the finest level, predicted from the surface that a coarser level has found \param bytes of them
/// \throw ResourceLimit if the bytes are above the limit, or the unknowns too many for the number of points
void checkSurface(double unknowns, double bytes, std::size_t points, double voxelSize, double limit);

} // namespace pcl::mrf

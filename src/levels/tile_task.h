// SPDX-License-Identifier: BSD-3-Clause
/// One tile of the finest level, as a task.
#pragma once

#include "levels/narrow_band.h"

#include <functional>
#include <string>
#include <vector>

namespace pcl::mrf {

/// The input of a tile's task. Lattices and fields are cut to the tile and its halo.
struct TileInput {
  std::vector<Lattice> lattices;    ///< the coarser one, and the tile's
  LevelField coarse;                ///< field of the coarser level
  std::vector<PointSample> samples; ///< on the tile's lattice, ordered by cells
  PointWeights weights;
  Prior prior = Prior::triharmonic;
  LevelPlan plan = {0, 0, 0}; ///< 0 threads: as many as the Execution has
  SolverOptions solver;
  BandTile tile;
};

struct TileResult {
  VoxelSet changed;    ///< unknowns on the tile's own planes, on a grid of these planes alone
  PackedValues change; ///< of the unknowns, packed
  VoxelSet observed;   ///< on the tile's grid
  TileStep step;       ///< of the own planes
  SolveReport solve;   ///< without history
};

/// The planes [first, first + count) of a set, on a grid of these planes alone.
VoxelSet cutPlanes(const VoxelSet& set, int first, int count, Execution& execution);

constexpr const char* tileKind = "tile";

/// Solves tiles, each by a step of its own length: calls use(n, result of makeInput(n)) in the order of n.
/// \throw what solveNarrowBand does; what TaskRunner::run does
void solveTiles(int count, const std::function<TileInput(int n)>& makeInput,
                const std::function<void(int n, TileResult result)>& use, Execution& execution);

/// Solves one tile, from bytes to bytes.
std::string solveTile(std::string input, Execution& execution);

} // namespace pcl::mrf

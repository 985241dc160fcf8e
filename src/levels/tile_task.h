// SPDX-License-Identifier: BSD-3-Clause
/// One tile of the finest level, as a task.
#pragma once

#include "levels/narrow_band.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pcl::mrf {

/// All that a tile is solved from. Lattices and fields are cut to the tile and its halo.
struct TileInput {
  std::vector<Lattice> lattices;    ///< the coarser one, and the tile's
  LevelField coarse;                ///< of the level before
  std::vector<PointSample> samples; ///< on the tile's lattice, by cells
  PointWeights weights;
  Prior prior = Prior::triharmonic;
  LevelPlan plan = {0, 0, 0}; ///< threads: 0 are as many as there are
  SolverOptions solver;
  bool isCutBelow = false, isCutAbove = false; ///< \see BandTile
  VoxelSet found;                              ///< likewise
  int begin = 0, end = 0;                      ///< planes of the tile's grid that are its own
};

struct TileResult {
  VoxelSet changed;    ///< unknowns of the tile's own planes, on a grid of these alone
  PackedValues change; ///< of them, packed
  VoxelSet observed;   ///< on the tile's grid
  TileStep step;       ///< of the own planes
  SolveReport solve;   ///< without history
};

/// Some planes of a set, on a grid that begins with plane `first` of the set's.
VoxelSet cutPlanes(const VoxelSet& set, int first, int count, Execution& execution);

constexpr const char* tileKind = "tile";

/// Solves tiles, each by a step of its own length: use(n, what became of makeInput(n)), in their order.
/// \throw what solveNarrowBand does; what TaskRunner::run does
void solveTiles(int count, const std::function<TileInput(int n)>& makeInput,
                const std::function<void(int n, TileResult result)>& use, Execution& execution);

/// One of them, from bytes to bytes.
std::string solveTile(std::string input, Execution& execution);

} // namespace pcl::mrf

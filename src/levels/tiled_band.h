// SPDX-License-Identifier: BSD-3-Clause
/// The finest level tile by tile, where the whole of it would take too much memory.
#pragma once

#include "levels/narrow_band.h"

namespace pcl::mrf {

/// Planes of the finest level on either side of a tile that are solved with it. On seven clouds in 3 to 9 tiles the
/// surface is less than 10⁻⁵ voxels RMS from that of the whole level, .0002 at most; 32 planes were no better on two.
constexpr int tileHalo = 16;

/// The finest level of a run, and what it observes.
struct TiledLevel {
  const PointsOnLattice& points; ///< on the level's lattice
  PointWeights weights;
  Prior prior;
  int tiles; ///< ≥ 1
};

/// Solves the finest level in a single step, as solveNarrowBand does, with a part of its memory.
///
/// A tile is a range of planes across z. Each tile is solved with tileHalo planes around it and with a step of its own
/// length. When all tiles are solved, their changes are scaled to the length of the step of the whole level. All tiles
/// together decide whether the coarser level has missed a sheet, so that bands have to grow. A step's effect beyond the
/// halo is lost in rounding: the field is that of the level solved as a whole.
/// \param coarse the field of the level before
/// \return the support and its values only
LevelField solveInTiles(const TiledLevel& level, const LevelField& coarse, const LevelPlan& plan,
                        const SolverOptions& solver, LevelReport& report, Execution& execution);

} // namespace pcl::mrf

/// \file
/// \brief The finer levels of the multiscale scheme: bands around the zero level that the coarser one predicts.
#pragma once

#include "band.h"
#include "band_data.h"
#include "band_transfer.h"

#include <pcl/surface/mrf/multiscale.h>
#include <pcl/surface/mrf/observation.h>
#include <pcl/surface/mrf/point_observation.h>

#include <vector>

namespace pcl {
namespace mrf {

/// The field of one level, as the next finer one needs it.
struct BandField {
  Lattice lattice;
  Band unknowns;       ///< voxels that were solved for
  Band support;        ///< voxels with a value: the unknowns and what the next level's interpolation reaches
  PackedValues values; ///< on the support
  Band observed;
};

/// A dense level as the coarsest of the bands; it is continued beyond its border. \param observed on its bands' grid
BandField bandOfDense(const Lattice& lattice, const std::vector<float>& values, Band observed, Execution& execution);

/// Drops what is neither near a surface nor near an observed voxel from the unknowns, as the next level sees them.
/// \param surface voxels at it
void keepNear(const Band& surface, BandField& field, Execution& execution);

/// What a level in a band observes: samples at points, or voxels.
struct BandObservation {
  const std::vector<std::vector<PointSample>>* samples = nullptr; ///< of all levels, ordered by cells
  PointWeights weights;                                           ///< of this level
  Observation voxels;                                             ///< if there are no samples
  float beta = 0;                                                 ///< PriorOptions::beta, with voxels
};

/// The voxels of an observation on the bands' grid.
Band bandOfVoxels(const std::vector<std::int64_t>& voxels, const GridSize& lattice, const GridSize& grid,
                  Execution& execution);

/// How far a level in a band is solved.
struct BandPlan {
  int steps;               ///< of conjugate gradients
  std::size_t coarseGrids; ///< of the preconditioner, beneath the level's own
  int threads = 1;         ///< that may sweep over it at the same time
};

/// Solves one level in a band.
///
/// Unknowns are the observed voxels and those within two voxels of the interpolated zero level, six where nothing is
/// observed near. Where the coarser level has missed a sheet that is observed, the band grows and is solved again.
/// \param lattices of all levels \param level ≥ 1 \param coarse the field of level − 1
BandField solveBandLevel(const std::vector<Lattice>& lattices, std::size_t level, const BandField& coarse,
                         const BandObservation& observation, Prior prior, const BandPlan& plan,
                         const SolverOptions& solver, bool isFinest, LevelReport& report, Execution& execution);

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
/// What a part of a cloud says about how far its surface may be off: draws, and points that were left out.
#pragma once

#include "uncertainty/held_out_pairs.h"
#include "uncertainty/opening_patches.h"
#include "uncertainty/uncertainty.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/options.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Points that a place is compared with: the mean has a quarter of the variance of their noise.
constexpr int nearestPoints = 4;

/// What is known at a vertex, or at a place whose error is.
struct Evidence {
  float variance = 0; ///< V over the squared slope
  float change = 0;   ///< δ², cloud's unit²
  float distance = 0; ///< to the nearest point, where none supports it; else 0
  float reach = 0;    ///< distance to the nearest point, in what that point supports: 1 where support ends
  float spacing = 1;  ///< of the points around, l̄
  float noise = 0;    ///< σ of the points around over that of the median point; 0: not known of each
  float offset = 0;   ///< mean distance from the nearest points, signed, where one supports it, cloud's unit
  float bias = 0;     ///< squared mean distance to the nearest points, cloud's unit²
  bool isInPatch = false;
};

/// A place in a disc that was left out, as it was filled.
struct FilledPlace {
  float variance, error, distance; ///< V over the squared slope; from the points that were left out; to the others
  std::int32_t patch;
};

/// What a piece of the cloud says.
struct PieceEvidence {
  double voxelSize = 0;             ///< of the grid of the draws, cloud's unit
  std::int64_t voxels = 0;          ///< of that grid
  std::vector<DistanceField> draws; ///< from the posterior for data of variance 1, less its mean
  std::vector<Patch> patches;
  std::vector<FilledPlace> filled; ///< in the patches, patch by patch
  std::vector<HeldOutPair> pairs;  ///< outside of the patches
  std::vector<Evidence> atPairs;
};

/// A piece, the field of all of the cloud and its mesh, and the vertices that are the piece's.
struct MeshedPiece {
  const SolvedPiece& piece;
  const DistanceField& field;
  const TriangleMesh& mesh;
  const std::vector<std::int32_t>& vertices;
};

/// Solves a piece on a coarse grid without some patches, draws from the posterior there, and looks at what was left
/// out. \param evidence of all vertices of the mesh: those of the piece are set \param seed of the draws
PieceEvidence gatherEvidence(const MeshedPiece& meshed, float spacing, const ResolvedOptions& options,
                             std::uint64_t seed, std::vector<Evidence>& evidence, Execution& execution);

} // namespace pcl::mrf

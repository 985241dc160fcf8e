// SPDX-License-Identifier: BSD-3-Clause
/// The evidence of a piece of a cloud on the error of its surface: draws, and points that were left out.
#pragma once

#include "uncertainty/held_out_pairs.h"
#include "uncertainty/uncertainty.h"

#include <pcl/surface/mrf/distance_field.h>

#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Number of nearest points that a place is compared with: their mean has a quarter of the variance of their noise.
constexpr int nearestPoints = 4;

/// The evidence at a vertex, or at a place whose error is known.
struct Evidence {
  float variance = 0; ///< V over the squared slope
  float change = 0;   ///< δ², cloud's unit²
  float distance = 0; ///< distance to the nearest point, cloud's unit; 0 where a point supports the surface
  float reach = 0;    ///< distance to the nearest point over that point's reach: 1 where support ends
  float spacing = 1;  ///< spacing of the points around, in l̄
  float noise = 0;    ///< σ of the points around over the median point's; 0: unknown
  float offset = 0;   ///< signed mean distance from the nearest points where one supports the surface, cloud's unit
  float bias = 0;     ///< squared mean distance to the nearest points, cloud's unit²
  bool isInPatch = false;
};

/// A disc of points that are left out, all of one sheet.
struct Patch {
  Eigen::Vector3f center;
  float radius; ///< cloud's unit
  std::vector<std::uint32_t> points;
};

/// A place on the filling of a left-out disc.
struct FilledPlace {
  /// V over the squared slope; distance from the points that were left out; distance to the nearest other point.
  float variance, error, distance;
  std::int32_t patch;
};

/// The evidence of a piece of the cloud.
struct PieceEvidence {
  double voxelSize = 0;             ///< voxel side of the grid of the draws, cloud's unit
  std::int64_t voxels = 0;          ///< of that grid
  std::vector<DistanceField> draws; ///< draws from the posterior for data of variance 1, minus its mean
  std::vector<Patch> patches;
  std::vector<FilledPlace> filled; ///< places in the patches, patch by patch
  std::vector<HeldOutPair> pairs;  ///< pairs outside of the patches
  std::vector<Evidence> atPairs;
};

/// A piece, the field and the mesh of the whole cloud, and the piece's vertices.
struct MeshedPiece {
  const SolvedPiece& piece;
  const DistanceField& field;
  const TriangleMesh& mesh;
  const std::vector<std::int32_t>& vertices;
};

/// Solves a piece without some patches on a coarse grid, draws from the posterior there, and compares with what was
/// left out. \param evidence of all vertices of the mesh; receives that of the piece's vertices \param seed of the
/// draws
PieceEvidence gatherEvidence(const MeshedPiece& meshed, float spacing, const ResolvedOptions& options,
                             std::uint64_t seed, std::vector<Evidence>& evidence, Execution& execution);

} // namespace pcl::mrf

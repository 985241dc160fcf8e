/// \file
/// \brief Transfers between a band and the one on the next coarser lattice.
#pragma once

#include "band.h"

#include <vector>

namespace pcl {
namespace mrf {

/// Voxels around a level's lattice that its bands have beside it: sheets run into the border, and their stencils and
/// interpolation reach over it.
constexpr int bandMargin = 4;

/// The size of the bands' grid around a lattice.
inline GridSize bandSize(const GridSize& size)
{
  return {size.x + 2 * bandMargin, size.y + 2 * bandMargin, size.z + 2 * bandMargin};
}

/// How the voxels of a level lie in those of the coarser one, in the indices of their bands' grids.
struct Refinement {
  Eigen::Array3i parity = Eigen::Array3i::Zero(); ///< 1 where voxel 0 is the second child of its parent

  Refinement() = default;
  Refinement(const Lattice& coarse, const Lattice& fine);

  int parent(int fine, int axis) const { return (fine + bandMargin + parity[axis]) >> 1; }
  bool isSecond(int fine, int axis) const { return ((fine + parity[axis]) & 1) != 0; }
  int firstChild(int coarse, int axis) const { return 2 * coarse - bandMargin - parity[axis]; }
};

/// A window and scratch rows of one thread, zero between uses.
struct TransferScratch {
  std::vector<float> window, rows;
};

/// interpolateCubic from band to band. Values missing in the coarse band count as zero: the caller sees to it that none
/// is needed.
class CubicInterpolation {
public:
  CubicInterpolation(const Band& coarse, const float* values, const Refinement& refinement)
      : coarse_(coarse), values_(values), refinement_(refinement)
  {}

  /// \param out packed values of the plane of `fine`
  void evaluatePlane(const Band& fine, int z, float* out, TransferScratch& scratch) const;

private:
  const Band& coarse_;
  const float* values_;
  Refinement refinement_;
};

/// window += P coarse on plane z of the fine band: interpolation with (¾, ¼).
void addProlonged(const Band& coarse, const float* values, const Refinement& refinement, const Band& fine, int z,
                  float* window, TransferScratch& scratch);

/// coarse = scale · Pᵀ fine on plane z of the coarse band.
void restrictPlane(const Band& fine, const float* values, const Refinement& refinement, float scale, const Band& coarse,
                   int z, float* out, TransferScratch& scratch);

/// The parents of a band's voxels. \param roundUpTo as in Band's constructor
Band coarsened(const Band& fine, const GridSize& coarse, const Refinement& refinement, int roundUpTo,
               Execution& execution);

} // namespace mrf
} // namespace pcl

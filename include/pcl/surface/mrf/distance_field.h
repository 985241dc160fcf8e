// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The regularized signed distance field and its geometry.
#pragma once

#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/lattice.h>

#include <Eigen/Core>

#include <cstdint>
#include <memory>
#include <vector>

namespace pcl::mrf {

struct BandedDistances;

/// Signed distance (cloud's unit, negative inside) per voxel, and where voxels were observed their local confidence α.
///
/// Dense, or stored in a band around the zero level only. Elsewhere a field in a band is what a coarser level says:
/// right in sign, and smooth. That may be a band as well, which holds the surface where it needs no finer voxels. The
/// stages behind the solver read it through the members below and not through its storage; `hasCell` tells which cells
/// are stored.
class PCL_MRF_EXPORT DistanceField {
public:
  DistanceField() = default;

  /// A dense field. \pre the arrays have lattice.size.count() values; no confidences: none are known
  DistanceField(const Lattice& lattice, std::vector<float> distances, std::vector<float> confidences);

  /// A field in a band. \param lattice as it is stored \param axes of the field in that order; see axes()
  DistanceField(const Lattice& lattice, std::shared_ptr<const BandedDistances> distances, AxisOrder axes = {});

  /// The field of a cloud in pieces that are far apart, each on its own lattice: that of the first, but a position is
  /// sampled in the piece whose lattice it is in or within a few voxels of. \pre not empty; the lattices are disjoint
  static DistanceField ofPieces(std::vector<DistanceField> pieces);

  /// The fields of the other pieces, as ofPieces was given them; mostly none.
  const std::vector<DistanceField>& otherPieces() const;

  const Lattice& lattice() const { return lattice_; }
  bool empty() const { return distances_.empty() && !banded_; }

  /// How the field lies in memory: its rows run along the stored x. All members speak of the field's own axes.
  AxisOrder axes() const { return axes_; }

  /// The same values as a field whose axes are those of the storage: for what goes over whole rows.
  DistanceField inStoredAxes() const;

  /// Signed distance at a voxel. \pre the voxel is inside the lattice
  float distance(int i, int j, int k) const
  {
    return banded_ ? bandedDistance(i, j, k) : distances_[lattice_.size.index(i, j, k)];
  }

  bool hasConfidences() const;

  /// Local confidence α at a voxel, 0..1. \pre hasConfidences()
  float confidence(int i, int j, int k) const;

  /// The coarser band that holds what this one does not; none if there is only one, or the field is dense.
  const DistanceField* coarserBand() const;

  /// Voxel side of the storage that a position of the recentered frame is read from, cloud's unit.
  double voxelSide(const Eigen::Vector3f& position) const;

  /// The storage of a field in a band, inside the library.
  const BandedDistances* banded() const { return banded_.get(); }

  /// True if the 8 voxels of the cell (i, j, k)..(i+1, j+1, k+1) are all stored.
  bool hasCell(int i, int j, int k) const
  {
    return i >= 0 && j >= 0 && k >= 0 && i + 1 < lattice_.size.x && j + 1 < lattice_.size.y &&
           k + 1 < lattice_.size.z && (!banded_ || bandHasCell(i, j, k));
  }

  /// Sets bit i % 64 of word i / 64 for each negative voxel of the row (j, k), ⌈size.x / 64⌉ words. Voxels that are
  /// not stored take the sign of the stored one before them.
  void signsOfRow(int j, int k, std::uint64_t* words) const;

  /// Trilinear interpolation of the distance at a position of the recentered frame, clamped to the lattice.
  float sampleDistance(const Eigen::Vector3f& position) const;

  /// Trilinear interpolation of central differences: continuous, not of unit length, points outward.
  Eigen::Vector3f sampleGradient(const Eigen::Vector3f& position) const;

  /// Both at once, for less than the two.
  float sampleDistance(const Eigen::Vector3f& position, Eigen::Vector3f& gradient) const;

  /// Bytes held, other pieces included.
  std::size_t bytes() const;

private:
  friend class FieldSampler;   // inside the library: many reads close to each other
  friend struct FieldContents; // likewise: a field for another process
  struct OtherPieces;

  const DistanceField& pieceAt(const Eigen::Vector3f& position) const;
  float bandedDistance(int i, int j, int k) const;
  std::int64_t packedIndex(int i, int j, int k) const; ///< in the band; −1 outside of it
  bool bandHasCell(int i, int j, int k) const;

  /// \name In the axes of the storage
  /// @{
  float storedDistance(int i, int j, int k) const;
  bool storesCell(int i, int j, int k) const;
  const DistanceField& bandAt(const Eigen::Vector3f& stored) const; ///< that a position is read from
  void distancesOfRow(int i, int j, int k, int count,
                      float* out) const; ///< of the voxels (i, j, k) .. (i + count − 1, j, k)
  Lattice stored_;
  /// @}

  AxisOrder axes_; ///< natural for a dense field
  Lattice lattice_;
  std::vector<float> distances_;
  std::vector<float> confidences_;
  std::shared_ptr<const BandedDistances> banded_; ///< of a field in a band; shared by its copies
  std::shared_ptr<const OtherPieces> others_;
};

} // namespace pcl::mrf

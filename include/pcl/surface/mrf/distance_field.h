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

/// A signed distance per voxel (cloud's unit, negative inside), and the local confidence α of observed voxels.
///
/// The field is dense, or stored only in a band around the zero level. Outside of the band it has the values of a
/// coarser level: their signs are right, and they are smooth. The coarser level may be a band too; it then also holds
/// the parts of the surface that need no finer voxels. `hasCell` tells which cells are stored. Code outside of the
/// solver reads the field through the members below, not through its storage.
class PCL_MRF_EXPORT DistanceField {
public:
  DistanceField() = default;

  /// A dense field. \pre the arrays have lattice.size.count() values; `confidences` may be empty: unknown
  DistanceField(const Lattice& lattice, std::vector<float> distances, std::vector<float> confidences);

  /// A field in a band. \param lattice in the axes of the storage \param axes order of the stored axes, see axes()
  DistanceField(const Lattice& lattice, std::shared_ptr<const BandedDistances> distances, AxisOrder axes = {});

  /// The field of a cloud in pieces that are far apart, each with its own lattice. Lattice and voxels are those of the
  /// first piece; a sampled position is read from the piece whose lattice contains it or is a few voxels away.
  /// \pre not empty; the lattices are disjoint
  static DistanceField ofPieces(std::vector<DistanceField> pieces);

  /// The fields of the other pieces, as given to ofPieces; usually none.
  const std::vector<DistanceField>& otherPieces() const;

  const Lattice& lattice() const { return lattice_; }
  bool empty() const { return distances_.empty() && !banded_; }

  /// The order of the axes in memory: rows run along the stored x. All other members use the field's own axes.
  AxisOrder axes() const { return axes_; }

  /// The same values as a field whose axes are the stored ones, for code that reads whole rows.
  DistanceField inStoredAxes() const;

  /// Signed distance at a voxel. \pre the voxel is inside the lattice
  float distance(int i, int j, int k) const
  {
    return banded_ ? bandedDistance(i, j, k) : distances_[lattice_.size.index(i, j, k)];
  }

  bool hasConfidences() const;

  /// Local confidence α at a voxel, 0..1. \pre hasConfidences()
  float confidence(int i, int j, int k) const;

  /// The coarser band that this band falls back to; null if there is only one band, or the field is dense.
  const DistanceField* coarserBand() const;

  /// Voxel side of the lattice that the value at a position of the recentered frame is read from, cloud's unit.
  double voxelSide(const Eigen::Vector3f& position) const;

  /// The storage of a field in a band, for use inside the library; null for a dense field.
  const BandedDistances* banded() const { return banded_.get(); }

  /// True if the 8 voxels of the cell (i, j, k)..(i+1, j+1, k+1) are all stored.
  bool hasCell(int i, int j, int k) const
  {
    return i >= 0 && j >= 0 && k >= 0 && i + 1 < lattice_.size.x && j + 1 < lattice_.size.y &&
           k + 1 < lattice_.size.z && (!banded_ || bandHasCell(i, j, k));
  }

  /// Sets bit i % 64 of word i / 64 for each negative voxel of the row (j, k); `words` has ⌈size.x / 64⌉ words. A
  /// voxel that is not stored takes the sign of the stored voxel before it.
  void signsOfRow(int j, int k, std::uint64_t* words) const;

  /// Trilinear interpolation of the distance at a position of the recentered frame, clamped to the lattice.
  float sampleDistance(const Eigen::Vector3f& position) const;

  /// Trilinear interpolation of central differences: continuous, points outward, is not of unit length.
  Eigen::Vector3f sampleGradient(const Eigen::Vector3f& position) const;

  /// Both at once, in less time than two calls.
  float sampleDistance(const Eigen::Vector3f& position, Eigen::Vector3f& gradient) const;

  /// Memory of the field and the other pieces, bytes.
  std::size_t bytes() const;

private:
  friend class FieldSampler;   // inside the library: many reads at close positions
  friend struct FieldContents; // inside the library: a field for another process
  struct OtherPieces;

  const DistanceField& pieceAt(const Eigen::Vector3f& position) const;
  float bandedDistance(int i, int j, int k) const;
  std::int64_t packedIndex(int i, int j, int k) const; ///< index in the band; −1 outside of it
  bool bandHasCell(int i, int j, int k) const;

  /// \name In the axes of the storage
  /// @{
  float storedDistance(int i, int j, int k) const;
  bool storesCell(int i, int j, int k) const;
  const DistanceField& bandAt(const Eigen::Vector3f& stored) const; ///< the band that a position is read from
  /// Distances of the voxels (i, j, k) .. (i + count − 1, j, k).
  void distancesOfRow(int i, int j, int k, int count, float* out) const;
  Lattice stored_;
  /// @}

  AxisOrder axes_; ///< natural for a dense field
  Lattice lattice_;
  std::vector<float> distances_;
  std::vector<float> confidences_;
  std::shared_ptr<const BandedDistances> banded_; ///< null for a dense field; shared by copies
  std::shared_ptr<const OtherPieces> others_;
};

} // namespace pcl::mrf

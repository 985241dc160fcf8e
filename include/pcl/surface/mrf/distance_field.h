/// \file
/// \brief The regularised signed distance field and its geometry.
#pragma once

#include <pcl/surface/mrf/lattice.h>

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// Signed distance (cloud's unit, negative inside) per voxel, and where voxels were observed their local confidence α.
///
/// The stages behind the solver read the field through the members below and never through its storage, so that the
/// storage may become sparse (bricks in a narrow band) without touching them. `hasCell` tells which cells exist.
class DistanceField {
public:
  DistanceField() = default;

  /// A dense field. \pre the arrays have lattice.size.count() values; no confidences: none are known
  DistanceField(const Lattice& lattice, std::vector<float> distances, std::vector<float> confidences);

  const Lattice& lattice() const { return lattice_; }
  bool empty() const { return distances_.empty(); }

  /// Signed distance at a voxel. \pre the voxel is inside the lattice
  float distance(int i, int j, int k) const
  {
    return distances_[static_cast<std::size_t>(lattice_.size.index(i, j, k))];
  }

  bool hasConfidences() const { return !confidences_.empty(); }

  /// Local confidence α at a voxel, 0..1. \pre hasConfidences()
  float confidence(int i, int j, int k) const
  {
    return confidences_[static_cast<std::size_t>(lattice_.size.index(i, j, k))];
  }

  /// True if the 8 voxels of the cell (i, j, k)..(i+1, j+1, k+1) are all stored.
  bool hasCell(int i, int j, int k) const
  {
    return i >= 0 && j >= 0 && k >= 0 && i + 1 < lattice_.size.x && j + 1 < lattice_.size.y && k + 1 < lattice_.size.z;
  }

  /// Trilinear interpolation of the distance at a position of the recentred frame, clamped to the lattice.
  float sampleDistance(const Eigen::Vector3f& position) const;

  /// Trilinear interpolation of central differences: continuous, not of unit length, points outward.
  Eigen::Vector3f sampleGradient(const Eigen::Vector3f& position) const;

  /// Bytes held.
  std::size_t bytes() const { return (distances_.capacity() + confidences_.capacity()) * sizeof(float); }

private:
  Lattice lattice_;
  std::vector<float> distances_;
  std::vector<float> confidences_;
};

} // namespace mrf
} // namespace pcl

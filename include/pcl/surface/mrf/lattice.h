// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Regular voxel lattices: sizes, indices, positions.
#pragma once

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>

namespace pcl::mrf {

/// Number of voxels along each axis.
struct GridSize {
  int x = 0, y = 0, z = 0;

  std::int64_t count() const { return std::int64_t{x} * y * z; }
  std::int64_t planeCount() const { return std::int64_t{x} * y; }
  std::int64_t index(int i, int j, int k) const { return i + std::int64_t{x} * (j + std::int64_t{y} * k); }
  /// The voxel of an index.
  Eigen::Array3i voxel(std::int64_t index) const
  {
    return {static_cast<int>(index % x), static_cast<int>(index / x % y), static_cast<int>(index / planeCount())};
  }
  bool contains(int i, int j, int k) const { return i >= 0 && j >= 0 && k >= 0 && i < x && j < y && k < z; }

  /// Size of the next coarser grid of cell-centered coarsening, ⌈n/2⌉ along each axis.
  GridSize coarsened() const { return {(x + 1) / 2, (y + 1) / 2, (z + 1) / 2}; }

  bool operator==(const GridSize& other) const { return x == other.x && y == other.y && z == other.z; }
  bool operator!=(const GridSize& other) const { return !(*this == other); }
};

/// A grid placed in the recentered frame of the points. Values sit at voxel centers; x runs fastest in memory.
struct Lattice {
  GridSize size;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(); ///< center of voxel (0, 0, 0)
  double spacing = 1;                               ///< voxel side h, cloud's unit

  Eigen::Vector3f position(int i, int j, int k) const
  {
    return (origin + spacing * Eigen::Vector3d(i, j, k)).cast<float>();
  }

  /// Position in units of voxels, relative to the center of voxel (0, 0, 0).
  Eigen::Vector3d toVoxels(const Eigen::Vector3f& position) const
  {
    return (position.cast<double>() - origin) / spacing;
  }
};

/// The order in which the axes of a frame are stored in memory.
struct AxisOrder {
  std::array<int, 3> axes{0, 1, 2}; ///< a permutation: the stored axis a is axis axes[a] of the frame

  bool isNatural() const { return axes[0] == 0 && axes[1] == 1; }
  /// True if the stored order is a mirror image of the frame.
  bool isMirrored() const { return (axes[1] - axes[0] + 3) % 3 != 1; }

  /// Converts from the frame to the stored order and back; for any type with three coefficients.
  template <typename Vector>
  Vector toStored(const Vector& v) const
  {
    return Vector(v[axes[0]], v[axes[1]], v[axes[2]]);
  }
  template <typename Vector>
  Vector fromStored(const Vector& v) const
  {
    Vector result = v;
    for (std::size_t a = 0; a < 3; ++a)
      result[axes[a]] = v[static_cast<Eigen::Index>(a)];
    return result;
  }
  GridSize toStored(const GridSize& size) const
  {
    const Eigen::Array3i stored = toStored(Eigen::Array3i(size.x, size.y, size.z));
    return {stored.x(), stored.y(), stored.z()};
  }
  GridSize fromStored(const GridSize& size) const
  {
    const Eigen::Array3i natural = fromStored(Eigen::Array3i(size.x, size.y, size.z));
    return {natural.x(), natural.y(), natural.z()};
  }
  Lattice toStored(const Lattice& lattice) const
  {
    return {toStored(lattice.size), toStored(lattice.origin), lattice.spacing};
  }
  Lattice fromStored(const Lattice& lattice) const
  {
    return {fromStored(lattice.size), fromStored(lattice.origin), lattice.spacing};
  }
};

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// Helpers of the polygonizers: the signs at the corners of 64 cells at a time, and zero crossings on lattice edges.
#pragma once

#include "mesh/cell_cases.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace pcl::mrf {

using Word = std::uint64_t;
constexpr int wordBits = 64;

/// The signs of the 8 corners of the 64 cells of one word, and which of these cells are cut.
struct CellWord {
  std::array<Word, 8> corners;
  Word cut;

  /// \param signs has shifted(w, dx, j, k): sign bits of the voxels (i + dx, j, k) for the 64 voxels i of word w; and
  /// inRow(w, dx): bits of the voxels i for which i + dx is in the row
  template <typename Signs>
  CellWord(const Signs& signs, int w, int j, int k)
  {
    Word any = 0, all = ~Word{0};
    for (int corner = 0; corner < 8; ++corner) {
      const Word bits = signs.shifted(w, corner & 1, j + (corner >> 1 & 1), k + (corner >> 2 & 1));
      corners[corner] = bits;
      any |= bits;
      all &= bits;
    }
    cut = any & ~all & signs.inRow(w, 1);
  }

  std::size_t caseOf(int bit) const
  {
    std::size_t signs = 0;
    for (std::size_t corner = 0; corner < 8; ++corner)
      signs |= static_cast<std::size_t>(corners[corner] >> bit & 1) << corner;
    return signs;
  }
};

/// Calls add(triangle) for the triangles of a cell. A quad is cut along its shorter diagonal.
/// \param vertexOn vertex on an edge of the cell \param vertices positions, by vertex
template <typename VertexOn, typename Add>
void forTrianglesOf(const CellCase& cell, const std::vector<Eigen::Vector3f>& vertices, const VertexOn& vertexOn,
                    const Add& add)
{
  for (const auto& quad : cell.quads) {
    const std::int32_t a = vertexOn(quad[0]), b = vertexOn(quad[1]), c = vertexOn(quad[2]), d = vertexOn(quad[3]);
    const bool alongAc = (vertices[a] - vertices[c]).squaredNorm() <= (vertices[b] - vertices[d]).squaredNorm();
    add(Triangle{a, b, alongAc ? c : d});
    add(Triangle{alongAc ? a : b, c, d});
  }
  for (const auto& triangle : cell.triangles)
    add(Triangle{vertexOn(triangle[0]), vertexOn(triangle[1]), vertexOn(triangle[2])});
}

/// Positions where edges of a lattice, or lines of several edges, cross the zero level.
class EdgeCrossings {
public:
  explicit EdgeCrossings(const Lattice& lattice) : lattice_(lattice), margin_(marginOf(lattice)) {}

  /// \param from, to ends of the edge, in voxels \param start, end signed distances there, of different signs
  Eigen::Vector3f position(const Eigen::Array3d& from, const Eigen::Array3d& to, double start, double end) const
  {
    const double share = start / (start - end);
    // A NaN, from a field that is not finite, fails the comparison and gives a position on the edge as well.
    const double inside = share > margin_ ? std::min(share, 1 - margin_) : margin_;
    return (lattice_.origin.array() + lattice_.spacing * (from + inside * (to - from))).cast<float>();
  }

private:
  /// Min distance of a vertex from the ends of its edge, as a share of the edge.
  ///
  /// Points on three edges of a cube are collinear only if two of them are at corners, and the third is on the edge
  /// between these corners. With a margin m the flattest triangle has the quality 4 m². Rounding to float moves a
  /// vertex by half a unit in the last place per axis; the second term keeps m well above that.
  static double marginOf(const Lattice& lattice)
  {
    const GridSize& size = lattice.size;
    const Eigen::Vector3d last = lattice.origin + lattice.spacing * Eigen::Vector3d(size.x, size.y, size.z);
    const double farthest = lattice.origin.cwiseAbs().cwiseMax(last.cwiseAbs()).maxCoeff();
    const double rounding = farthest / lattice.spacing * std::numeric_limits<float>::epsilon() / 2;
    return std::min(1. / 512 + 8 * rounding, .25);
  }

  Lattice lattice_;
  double margin_;
};

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// How the zero level passes through one cell, for each of the 256 sign patterns of its corners.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace pcl::mrf {

/// An edge of a cell: from a corner along an axis to the next. Corners are numbered by bits (x = 1, y = 2, z = 4).
struct CellEdge {
  std::uint8_t corner, axis;
};

/// Polygons of one sign pattern, as indices into CellTable::edges, counter-clockwise seen from the positive side.
struct CellCase {
  std::vector<std::array<std::uint8_t, 4>> quads; ///< either diagonal may split one
  std::vector<std::array<std::uint8_t, 3>> triangles;
};

/// All cases. Bit c of a case is set if corner c is negative.
struct CellTable {
  std::vector<CellEdge> edges; ///< sorted by axis, then by corner
  std::array<CellCase, 256> cases;
};

/// The cases of a cube: the zero level cuts the cube's faces in closed loops of segments, which are triangulated.
///
/// On a face with alternating signs the segments separate the two negative corners. The cells on both sides of a face
/// see the same four signs, hence the same segments. No triangulation uses a diagonal between two vertices of one face:
/// the neighbor could use it too, and the edge would have four triangles. All loops (3 to 7 vertices) allow that.
const CellTable& cubeTable();

/// The corners of a cube's face, counter-clockwise seen from outside the cube.
std::array<int, 4> faceCorners(int axis, int side);

using LoopTriangles = std::vector<std::array<std::size_t, 3>>;
using DiagonalCost = std::function<double(std::size_t a, std::size_t b)>; ///< infinity forbids the diagonal

/// The triangulation of a loop with the lowest sum of diagonal costs; empty if each one needs a forbidden diagonal.
LoopTriangles triangulateLoop(std::size_t size, const DiagonalCost& costOf);

} // namespace pcl::mrf

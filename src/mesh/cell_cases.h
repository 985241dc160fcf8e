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

/// Polygons of one sign pattern: indices into CellTable::edges, counter-clockwise seen from the positive side.
struct CellCase {
  std::vector<std::array<std::uint8_t, 4>> quads; ///< either diagonal may be taken
  std::vector<std::array<std::uint8_t, 3>> triangles;
};

/// All cases. Bit c of a case is set if corner c is negative.
struct CellTable {
  std::vector<CellEdge> edges; ///< by axes, then by corners
  std::array<CellCase, 256> cases;
};

/// Cubes: the loops in which the zero level leaves the cell through its faces, triangulated.
///
/// On a face whose signs alternate the negative corners are separated. Neighbors see the same four signs, hence the
/// same segments. No triangulation uses a diagonal between two vertices of one face: the neighbor could use it too,
/// and the edge would have four triangles. All loops (3 to 7 vertices) can be triangulated so.
const CellTable& cubeTable();

/// The corners of a cube's face, counter-clockwise seen from outside the cube.
std::array<int, 4> faceCorners(int axis, int side);

using LoopTriangles = std::vector<std::array<std::size_t, 3>>;
using DiagonalCost = std::function<double(std::size_t a, std::size_t b)>; ///< infinite: must not be used

/// The triangles of a loop that have the cheapest diagonals; none if it cannot do without those that must not be used.
LoopTriangles triangulateLoop(std::size_t size, const DiagonalCost& costOf);

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/cell_cases.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace pcl::mrf {
namespace {

using Loop = std::vector<std::uint8_t>;

std::uint8_t edgeBetween(const CellTable& table, int cornerA, int cornerB)
{
  const int lower = cornerA & cornerB, direction = cornerA ^ cornerB;
  const auto found = std::find_if(table.edges.begin(), table.edges.end(), [&](const CellEdge& edge) {
    return edge.corner == lower && 1 << edge.axis == direction;
  });
  return static_cast<std::uint8_t>(found - table.edges.begin());
}

/// Twice the midpoint of an edge, exact.
std::array<int, 3> doubledMidpoint(const CellEdge& edge)
{
  std::array<int, 3> middle{};
  for (int axis = 0; axis < 3; ++axis)
    middle[axis] = 2 * (edge.corner >> axis & 1) + (edge.axis == axis ? 1 : 0);
  return middle;
}

int squaredDistance(const std::array<int, 3>& a, const std::array<int, 3>& b)
{
  int sum = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    sum += (a[axis] - b[axis]) * (a[axis] - b[axis]);
  return sum;
}

/// Bit 2·axis + side for each of the two faces that a cube edge belongs to.
int facesOf(const CellEdge& edge)
{
  int faces = 0;
  for (int axis = 0; axis < 3; ++axis)
    if (edge.axis != axis)
      faces |= 1 << (2 * axis + (edge.corner >> axis & 1));
  return faces;
}

/// Triangulates a loop with short diagonals, measured between the midpoints of the cube's edges; none is in a face.
void appendTriangles(const CellTable& table, const Loop& loop, std::vector<std::array<std::uint8_t, 3>>& triangles)
{
  const LoopTriangles of = triangulateLoop(loop.size(), [&](std::size_t a, std::size_t b) {
    const CellEdge &edgeA = table.edges[loop[a]], &edgeB = table.edges[loop[b]];
    return facesOf(edgeA) & facesOf(edgeB) ? std::numeric_limits<double>::infinity()
                                           : squaredDistance(doubledMidpoint(edgeA), doubledMidpoint(edgeB));
  });
  if (of.empty())
    throw std::logic_error("a loop cannot be triangulated without a diagonal in a face");
  for (const auto& [a, b, c] : of)
    triangles.push_back({loop[a], loop[b], loop[c]});
}

/// Each run of negative corners around a face gets one segment, from the edge before the run to the edge after it: in
/// this direction the loop turns counter-clockwise seen from the positive side.
std::vector<Loop> traceLoops(const CellTable& table, int signs)
{
  const auto isNegative = [&](int corner) { return (signs >> corner & 1) != 0; };
  constexpr std::uint8_t none = 255;
  std::array<std::uint8_t, 12> next;
  next.fill(none);
  for (int face = 0; face < 6; ++face) {
    const std::array<int, 4> corners = faceCorners(face / 2, face % 2);
    for (std::size_t m = 0; m < 4; ++m) {
      const int before = corners[(m + 3) % 4];
      if (isNegative(before) || !isNegative(corners[m]))
        continue;
      std::size_t last = m;
      while (isNegative(corners[(last + 1) % 4]))
        ++last;
      next[edgeBetween(table, before, corners[m])] = edgeBetween(table, corners[last % 4], corners[(last + 1) % 4]);
    }
  }
  std::vector<Loop> loops;
  for (std::uint8_t& start : next) {
    Loop loop;
    for (std::uint8_t* edge = &start; *edge != none; edge = &next[loop.back()]) {
      loop.push_back(*edge);
      *edge = none;
    }
    if (!loop.empty())
      loops.push_back(loop);
  }
  return loops;
}

CellTable makeCubeTable()
{
  CellTable table;
  for (std::uint8_t axis = 0; axis < 3; ++axis)
    for (std::uint8_t corner = 0; corner < 8; ++corner)
      if ((corner >> axis & 1) == 0)
        table.edges.push_back({corner, axis});
  for (int signs = 0; signs < 256; ++signs) {
    CellCase& cell = table.cases[signs];
    for (const Loop& loop : traceLoops(table, signs)) {
      // The four vertices of a quad lie on parallel edges or around one edge: its diagonals are never in a face.
      if (loop.size() == 4)
        cell.quads.push_back({loop[0], loop[1], loop[2], loop[3]});
      else
        appendTriangles(table, loop, cell.triangles);
    }
  }
  return table;
}

} // namespace

std::array<int, 4> faceCorners(int axis, int side)
{
  const int u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, base = side << axis;
  std::array<int, 4> corners{base, base | u, base | u | v, base | v};
  if (side == 0)
    std::reverse(corners.begin(), corners.end());
  return corners;
}

LoopTriangles triangulateLoop(std::size_t size, const DiagonalCost& costOf)
{
  // By dynamic programming: the cheapest triangulations of the vertices first..last, which the diagonal between these
  // two cuts off, for longer and longer spans.
  constexpr double infinity = std::numeric_limits<double>::infinity();
  std::vector<double> costs(size * size, 0);
  std::vector<std::size_t> apexes(size * size, 0);
  for (std::size_t span = 2; span < size; ++span)
    for (std::size_t first = 0, last = span; last < size; ++first, ++last) {
      double best = infinity;
      for (std::size_t apex = first + 1; apex < last; ++apex)
        if (const double cost = costs[first * size + apex] + costs[apex * size + last]; cost < best) {
          best = cost;
          apexes[first * size + last] = apex;
        }
      costs[first * size + last] = best + (span + 1 < size ? costOf(first, last) : 0);
    }
  LoopTriangles triangles;
  const std::function<void(std::size_t, std::size_t)> append = [&](std::size_t first, std::size_t last) {
    if (last - first < 2)
      return;
    const std::size_t apex = apexes[first * size + last];
    append(first, apex);
    triangles.push_back({first, apex, last});
    append(apex, last);
  };
  if (costs[size - 1] < infinity)
    append(0, size - 1);
  return triangles;
}

const CellTable& cubeTable()
{
  static const CellTable table = makeCubeTable();
  return table;
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/polygonizer.h"

#include "field/voxel_set.h"
#include "mesh/cell_cases.h"
#include "mesh/lattice_cells.h"
#include "mesh/mesh_topology.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

namespace pcl::mrf {
namespace {

/// Consecutive planes of a lattice.
struct PlaneRange {
  int begin = 0, end = 0;
};

/// One bit per voxel of some planes, 64 along x per word: set where the distance is negative.
class SignBits {
public:
  SignBits(const DistanceField& field, PlaneRange planes)
      : size_(field.lattice().size), planes_(planes), wordsPerRow_((size_.x + wordBits - 1) / wordBits),
        words_(index(0, 0, planes.end))
  {
    for (int k = planes.begin; k < planes.end; ++k)
      for (int j = 0; j < size_.y; ++j)
        field.signsOfRow(j, k, words_.data() + index(0, j, k));
  }

  int wordsPerRow() const { return wordsPerRow_; }
  std::size_t index(int w, int j, int k) const
  {
    return static_cast<std::size_t>(w + std::int64_t{wordsPerRow_} * (j + std::int64_t{size_.y} * (k - planes_.begin)));
  }

  /// The signs of the voxels (i + dx, j, k), dx 0 or 1, for the 64 voxels i of word w. Beyond the row: not negative.
  Word shifted(int w, int dx, int j, int k) const
  {
    const Word* const row = words_.data() + index(0, j, k);
    return dx == 0 ? row[w] : nextBits(row, w, wordsPerRow_);
  }

  /// The voxels i of word w for which i + dx is in the row.
  Word inRow(int w, int dx) const
  {
    const int valid = std::min(size_.x - dx - w * wordBits, wordBits);
    return valid <= 0 ? 0 : ~Word{0} >> (wordBits - valid);
  }

private:
  GridSize size_;
  PlaneRange planes_;
  int wordsPerRow_;
  std::vector<Word> words_;
};

/// Numbers the cut edges that start in some planes: one bit per voxel and axis, and the number of the first edge of
/// each word. An edge's number is found by counting bits, so that no table of one index per edge is needed.
class CutEdges {
public:
  /// \pre signs cover these planes and the next one, if the lattice has it
  CutEdges(const SignBits& signs, GridSize size, PlaneRange planes)
      : signs_(signs), size_(size), cut_(3 * signs.index(0, 0, planes.end), 0), first_(cut_.size(), 0)
  {}

  /// Marks the edges that start in plane k. \return how many
  std::int64_t markPlane(int k)
  {
    std::int64_t count = 0;
    forEachWord(k, [&](int w, int j, int axis, std::size_t at) {
      const int dx = axis == 0, dy = axis == 1, dz = axis == 2;
      if (j + dy < size_.y && k + dz < size_.z)
        cut_[at] = (signs_.shifted(w, 0, j, k) ^ signs_.shifted(w, dx, j + dy, k + dz)) & signs_.inRow(w, dx);
      count += __builtin_popcountll(cut_[at]);
    });
    return count;
  }

  /// Numbers the marked edges of plane k from `number` on and calls visit(number, i, j, k, axis) for each.
  template <typename Visit>
  void numberPlane(int k, std::int32_t number, const Visit& visit)
  {
    forEachWord(k, [&](int w, int j, int axis, std::size_t at) {
      first_[at] = number;
      for (Word bits = cut_[at]; bits != 0; bits &= bits - 1)
        visit(number++, w * wordBits + __builtin_ctzll(bits), j, k, axis);
    });
  }

  /// Number of the edge that starts at voxel (i, j, k). \pre it is cut
  std::int32_t number(int i, int j, int k, int axis) const
  {
    const std::size_t at = 3 * signs_.index(i / wordBits, j, k) + axis;
    return first_[at] + __builtin_popcountll(cut_[at] & ((Word{1} << (i % wordBits)) - 1));
  }

private:
  template <typename Body>
  void forEachWord(int k, const Body& body)
  {
    for (int j = 0; j < size_.y; ++j)
      for (int w = 0; w < signs_.wordsPerRow(); ++w)
        for (int axis = 0; axis < 3; ++axis)
          body(w, j, axis, 3 * signs_.index(w, j, k) + axis);
  }

  const SignBits& signs_;
  GridSize size_;
  std::vector<Word> cut_;
  std::vector<std::int32_t> first_;
};

/// Replaces counts by the sums of those before them. \return the total
std::int64_t accumulate(std::vector<std::int64_t>& counts, const char* what)
{
  const std::int64_t last = counts.back();
  std::exclusive_scan(counts.begin(), counts.end(), counts.begin(), std::int64_t{0});
  const std::int64_t total = counts.back() + last;
  // The three sides of each triangle are numbered as well.
  if (total > std::numeric_limits<std::int32_t>::max() / 3)
    throw ResourceLimit("the zero level has " + std::to_string(total) + ' ' + what +
                        ", more than 32-bit indices can tell apart; use larger voxels");
  return total;
}

class Polygonizer {
public:
  Polygonizer(const DistanceField& field, Execution& execution)
      : field_(field), execution_(execution), size_(field.lattice().size), crossings_(field.lattice())
  {}

  TriangleMesh run()
  {
    // Each pass computes signs and edges again: kept for all planes, they would take more memory than the field.
    firstVertex_.resize(size_.z);
    std::vector<std::int64_t> firstTriangle(firstVertex_);
    forPieces([&](PlaneRange planes) {
      const SignBits signs(field_, {planes.begin, std::min(planes.end + 1, size_.z)});
      CutEdges edges(signs, size_, planes);
      for (int k = planes.begin; k < planes.end; ++k) {
        firstVertex_[k] = edges.markPlane(k);
        if (k + 1 < size_.z)
          firstTriangle[k] = countTriangles(signs, k);
      }
    });
    mesh_.vertices.resize(accumulate(firstVertex_, "vertices"));
    mesh_.triangles.resize(accumulate(firstTriangle, "triangles"));

    forPieces([&](PlaneRange planes) {
      const SignBits signs(field_, {planes.begin, std::min(planes.end + 1, size_.z)});
      CutEdges edges(signs, size_, planes);
      number(edges, planes, [&](std::int32_t number, int i, int j, int k, int axis) {
        mesh_.vertices[number] = crossing(i, j, k, axis);
      });
    });
    forPieces([&](PlaneRange planes) {
      // The cells above the last plane have edges in the next one.
      const PlaneRange ofEdges{planes.begin, std::min(planes.end + 1, size_.z)};
      const SignBits signs(field_, {planes.begin, std::min(planes.end + 2, size_.z)});
      CutEdges edges(signs, size_, ofEdges);
      number(edges, ofEdges, [](std::int32_t, int, int, int, int) {});
      for (int k = planes.begin; k < std::min(planes.end, size_.z - 1); ++k)
        writeTriangles(signs, edges, k, mesh_.triangles.data() + firstTriangle[k]);
    });
    // Around a missing cell, vertices may have no triangle, or triangles on two sides of the gap.
    if (cellsMissing_) {
      mesh_ = select(mesh_, std::vector<std::uint8_t>(mesh_.triangles.size(), 1));
      splitFans(mesh_);
    }
    return std::move(mesh_);
  }

private:
  static constexpr int piecePlanes = 16;

  template <typename Body>
  void forPieces(const Body& body)
  {
    execution_.forRange(size_.z, piecePlanes, [&](int begin, int end) { body(PlaneRange{begin, end}); });
    execution_.poll();
  }

  template <typename Visit>
  void number(CutEdges& edges, PlaneRange planes, const Visit& visit) const
  {
    for (int k = planes.begin; k < planes.end; ++k) {
      edges.markPlane(k);
      edges.numberPlane(k, static_cast<std::int32_t>(firstVertex_[k]), visit);
    }
  }

  Eigen::Vector3f crossing(int i, int j, int k, int axis) const
  {
    const Eigen::Array3i from(i, j, k), to = from + Eigen::Array3i(axis == 0, axis == 1, axis == 2);
    return crossings_.position(from.cast<double>(), to.cast<double>(), field_.distance(i, j, k),
                               field_.distance(to.x(), to.y(), to.z()));
  }

  /// Calls visit(case, i, j) for the cut cells between the planes k and k + 1.
  template <typename Visit>
  void forEachCutCell(const SignBits& signs, int k, const Visit& visit)
  {
    for (int j = 0; j + 1 < size_.y; ++j)
      for (int w = 0; w < signs.wordsPerRow(); ++w) {
        const CellWord cells(signs, w, j, k);
        for (Word cut = cells.cut; cut != 0; cut &= cut - 1) {
          const int bit = __builtin_ctzll(cut), i = w * wordBits + bit;
          if (field_.hasCell(i, j, k))
            visit(table_.cases[cells.caseOf(bit)], i, j);
          else
            cellsMissing_ = true;
        }
      }
  }

  std::int64_t countTriangles(const SignBits& signs, int k)
  {
    std::size_t count = 0;
    forEachCutCell(signs, k,
                   [&](const CellCase& cell, int, int) { count += 2 * cell.quads.size() + cell.triangles.size(); });
    return static_cast<std::int64_t>(count);
  }

  void writeTriangles(const SignBits& signs, const CutEdges& edges, int k, Triangle* out)
  {
    forEachCutCell(signs, k, [&](const CellCase& cell, int i, int j) {
      const auto vertexOn = [&](std::uint8_t e) {
        const CellEdge edge = table_.edges[e];
        return edges.number(i + (edge.corner & 1), j + (edge.corner >> 1 & 1), k + (edge.corner >> 2 & 1), edge.axis);
      };
      forTrianglesOf(cell, mesh_.vertices, vertexOn, [&](const Triangle& triangle) { *out++ = triangle; });
    });
  }

  const DistanceField& field_;
  const CellTable& table_ = cubeTable();
  Execution& execution_;
  GridSize size_;
  EdgeCrossings crossings_;
  std::vector<std::int64_t> firstVertex_; ///< on the edges that start in each plane
  std::atomic<bool> cellsMissing_{false};
  TriangleMesh mesh_;
};

/// \pre the field's axes are in the order of its storage
TriangleMesh polygonizeStored(const DistanceField& field, Execution& execution)
{
  return field.coarserBand() ? polygonizeOctree(field, execution) : Polygonizer(field, execution).run();
}

TriangleMesh polygonizePiece(const DistanceField& field, Execution& execution)
{
  const AxisOrder axes = field.axes();
  if (axes.isNatural())
    return polygonizeStored(field, execution);
  TriangleMesh mesh = polygonizeStored(field.inStoredAxes(), execution);
  for (Eigen::Vector3f& vertex : mesh.vertices)
    vertex = axes.fromStored(vertex);
  if (axes.isMirrored())
    for (Triangle& triangle : mesh.triangles)
      std::swap(triangle[1], triangle[2]);
  return mesh;
}

/// Adds a mesh without fields to another.
void append(TriangleMesh& mesh, const TriangleMesh& other)
{
  if (mesh.triangles.size() + other.triangles.size() > std::numeric_limits<std::int32_t>::max() / 3)
    throw ResourceLimit("the zero levels of the pieces have more triangles than 32-bit indices can tell apart; use "
                        "larger voxels");
  const auto first = static_cast<std::int32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const Triangle& t : other.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

} // namespace

TriangleMesh polygonize(const DistanceField& field, Execution& execution)
{
  if (field.empty())
    return {};
  TriangleMesh mesh = polygonizePiece(field, execution);
  for (const DistanceField& piece : field.otherPieces())
    append(mesh, polygonizePiece(piece, execution));
  return mesh;
}

} // namespace pcl::mrf

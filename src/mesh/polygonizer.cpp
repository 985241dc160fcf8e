// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/polygonizer.h"

#include "mesh/cell_cases.h"
#include "mesh/mesh_topology.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <string>
#include <utility>

namespace pcl::mrf {
namespace {

using Word = std::uint64_t;
constexpr int wordBits = 64;

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
    const std::size_t at = index(w, j, k);
    if (dx == 0)
      return words_[at];
    const Word next = w + 1 < wordsPerRow_ ? words_[at + 1] : 0;
    return words_[at] >> 1 | next << (wordBits - 1);
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

/// The signs of the 8 corners of the 64 cells of one word, and which of these cells are cut.
struct CellWord {
  std::array<Word, 8> corners;
  Word cut;

  CellWord(const SignBits& signs, int w, int j, int k)
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

/// Numbers the cut edges that start in some planes: one bit per voxel and axis, and the number of the first edge of
/// each word. An edge's number is found by counting bits, so that no table of one index per edge is needed.
class CutEdges {
public:
  /// \pre signs cover one plane more than these, if the lattice has it
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
  std::int64_t total = 0;
  for (std::int64_t& count : counts) {
    const std::int64_t before = total;
    total += count;
    count = before;
  }
  // Sides of triangles are numbered as well, three each.
  if (total > std::numeric_limits<std::int32_t>::max() / 3)
    throw ResourceLimit("the zero level has " + std::to_string(total) + ' ' + what +
                        ", more than 32-bit indices can tell apart; use larger voxels");
  return total;
}

class Polygonizer {
public:
  Polygonizer(const DistanceField& field, Execution& execution)
      : field_(field), execution_(execution), size_(field.lattice().size), margin_(crossingMargin(field.lattice()))
  {}

  TriangleMesh run()
  {
    // Signs and edges are found again in each pass: for all planes at once they would take more than the field.
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
    // Around a missing cell, edges may be left without a triangle, and others with triangles on two sides of the gap.
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
    execution_.forRange(size_.z, piecePlanes, [&](std::int64_t begin, std::int64_t end) {
      body(PlaneRange{static_cast<int>(begin), static_cast<int>(end)});
    });
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

  /// How close to the ends of its edge a vertex may be, as a share of the edge.
  ///
  /// Points on different edges of a cube are collinear only if one lies on an edge between corners that the two others
  /// have reached. With a margin m the flattest such triangle has the quality 4 m². Rounding to
  /// float moves a vertex by half a unit in the last place r per axis; the second term keeps m well above it.
  static double crossingMargin(const Lattice& lattice)
  {
    const GridSize& size = lattice.size;
    const Eigen::Vector3d last = lattice.origin + lattice.spacing * Eigen::Vector3d(size.x, size.y, size.z);
    const double farthest = lattice.origin.cwiseAbs().cwiseMax(last.cwiseAbs()).maxCoeff();
    const double rounding = farthest / lattice.spacing * std::numeric_limits<float>::epsilon() / 2;
    return std::min(1. / 512 + 8 * rounding, .25);
  }

  Eigen::Vector3f crossing(int i, int j, int k, int axis) const
  {
    const Eigen::Vector3i step = Eigen::Vector3i::Unit(axis);
    const double start = field_.distance(i, j, k);
    const double end = field_.distance(i + step.x(), j + step.y(), k + step.z());
    const double share = start / (start - end);
    // Written so that a NaN, from a field that is not finite, gives a position on the edge as well.
    const double inside = share > margin_ ? std::min(share, 1 - margin_) : margin_;
    const Lattice& lattice = field_.lattice();
    const Eigen::Vector3d voxel = Eigen::Vector3d(i, j, k) + inside * step.cast<double>();
    return (lattice.origin + lattice.spacing * voxel).cast<float>();
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
      const auto vertex = [&](std::uint8_t e) {
        const CellEdge edge = table_.edges[e];
        return edges.number(i + (edge.corner & 1), j + (edge.corner >> 1 & 1), k + (edge.corner >> 2 & 1), edge.axis);
      };
      for (const auto& quad : cell.quads) {
        const std::int32_t a = vertex(quad[0]), b = vertex(quad[1]), c = vertex(quad[2]), d = vertex(quad[3]);
        const bool alongAc = squaredLength(a, c) <= squaredLength(b, d);
        *out++ = {a, b, alongAc ? c : d};
        *out++ = {alongAc ? a : b, c, d};
      }
      for (const auto& triangle : cell.triangles)
        *out++ = {vertex(triangle[0]), vertex(triangle[1]), vertex(triangle[2])};
    });
  }

  float squaredLength(std::int32_t a, std::int32_t b) const
  {
    return (mesh_.vertices[a] - mesh_.vertices[b]).squaredNorm();
  }

  const DistanceField& field_;
  const CellTable& table_ = cubeTable();
  Execution& execution_;
  GridSize size_;
  double margin_;
  std::vector<std::int64_t> firstVertex_; ///< of the edges that start in each plane
  std::atomic<bool> cellsMissing_{false};
  TriangleMesh mesh_;
};

TriangleMesh polygonizePiece(const DistanceField& field, Execution& execution)
{
  const AxisOrder axes = field.axes();
  if (axes.isNatural())
    return Polygonizer(field, execution).run();
  TriangleMesh mesh = Polygonizer(field.inStoredAxes(), execution).run();
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

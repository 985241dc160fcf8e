// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/polygonizer.h"

#include "base/cell_hash.h"
#include "base/loops.h"
#include "field/field_contents.h"
#include "field/grid_transfer.h"
#include "mesh/cell_cases.h"
#include "mesh/lattice_cells.h"
#include "mesh/mesh_topology.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

using Place = CellHash::Cell; ///< index of a voxel of the finest lattice, or of a cell of one level

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The cells of one level. Their side is 2^level voxels of the finest lattice, their corners are at multiples of that.
struct Octants {
  GridSize grid;
  VoxelSet stored; ///< cells of the band with voxels of this size; at level 0 by their lowest voxels
  VoxelSet split;  ///< cells that are divided into smaller ones
};

/// Sets the cells of a plane that contain cells of a set, which are half as large.
void addParents(const VoxelSet& set, int z, MaskPlane& mask)
{
  for (const int plane : {2 * z, 2 * z + 1})
    set.forRuns(plane, [&](const Run& run, int x, int y) { mask.setRange(x >> 1, (x + run.count + 1) >> 1, y >> 1); });
}

/// Sets the cells of a plane that lie inside cells of a set, which are 2^levels times as large.
void addInside(const VoxelSet& set, int levels, int z, MaskPlane& mask)
{
  set.forRuns(z >> levels, [&](const Run& run, int x, int y) {
    for (int row = y << levels; row < std::min((y + 1) << levels, mask.rows()); ++row)
      mask.setRange(x << levels, (x + run.count) << levels, row);
  });
}

/// Calls visit(x, y) for all bits that are set.
template <typename Visit>
void forBits(const MaskPlane& mask, const Visit& visit)
{
  for (int y = 0; y < mask.rows(); ++y)
    for (int w = 0; mask.isUsed(y) && w < mask.words(); ++w)
      for (Word bits = mask.row(y)[w]; bits != 0; bits &= bits - 1)
        visit(w * wordBits + __builtin_ctzll(bits), y);
}

/// The signs at the corners of a plane of cells.
struct CornerSigns {
  std::array<const MaskPlane*, 2> planes; ///< below and above

  Word shifted(int w, int dx, int j, int k) const
  {
    const MaskPlane& plane = *planes[k];
    const Word* row = plane.row(j);
    return dx == 0 ? row[w] : nextBits(row, w, plane.words());
  }
  static Word inRow(int, int) { return ~Word{0}; }
};

std::int64_t sideOf(int level)
{
  return std::int64_t{1} << level;
}

Place unit(int axis)
{
  return Place(axis == 0, axis == 1, axis == 2);
}

/// Offset of a corner or a child of a cube; bits 0, 1 and 2 are x, y and z.
Place offset(int bits)
{
  return Place(bits & 1, bits >> 1 & 1, bits >> 2 & 1);
}

/// The cells of a plane that are not split.
struct CellPlane {
  MaskPlane cells;
  MaskPlane inLarger; ///< cells inside larger stored cells, whether those are split or not
};

/// The cells of all levels that the surface is extracted from.
class Octree {
public:
  Octree(const DistanceField& field, Execution& execution) : field_(field), execution_(execution)
  {
    findStored();
    for (std::size_t level = 1; level < octants_.size(); ++level)
      octants_[level].split = VoxelSet(octants_[level].grid, execution_, [&](int z, MaskPlane& mask) {
        octants_[level].stored.rasterize(z, mask);
        mask.unite(inLargerAt(level, z));
        MaskPlane complete = mask;
        keepComplete(level, z, complete);
        mask.subtract(complete); // at the lattice's border smaller cells come closer to it
        addParents(octants_[level - 1].stored, z, mask);
        if (level > 1)
          addParents(octants_[level - 1].split, z, mask);
      });
  }

  const DistanceField& field() const { return field_; }
  int levels() const { return static_cast<int>(octants_.size()); }
  const Octants& operator[](int level) const { return octants_[level]; }

  CellPlane cellsAt(std::size_t level, int z) const
  {
    CellPlane plane{MaskPlane(octants_[level].grid), inLargerAt(level, z)};
    octants_[level].stored.rasterize(z, plane.cells);
    plane.cells.unite(plane.inLarger);
    keepComplete(level, z, plane.cells);
    MaskPlane other(octants_[level].grid);
    if (level + 1 < octants_.size()) {
      addInside(octants_[level + 1].split, 1, z, other);
      plane.cells.intersect(other);
    }
    if (level > 0) {
      other.clear();
      octants_[level].split.rasterize(z, other);
      plane.cells.subtract(other);
    }
    return plane;
  }

  /// The corners in plane z where the distance is negative. \param corners those to look at
  MaskPlane negatives(int level, int z, const MaskPlane& corners) const
  {
    const auto own = static_cast<std::size_t>(level);
    MaskPlane negative(octants_[own].grid), known(octants_[own].grid);
    if (level == 0) {
      octants_[own].stored.rasterize(z, known);
      MaskPlane signs(field_.lattice().size);
      for (int y = 0; y < signs.rows(); ++y) {
        if (!known.isUsed(y))
          continue;
        field_.signsOfRow(y, z, signs.row(y));
        std::copy_n(signs.row(y), signs.words(), negative.row(y));
      }
      negative.intersect(known);
    }
    MaskPlane asked(corners);
    asked.subtract(known);
    forBits(asked, [&](int x, int y) {
      if (distance(sideOf(level) * Place(x, y, z)) < 0)
        negative.set(x, y);
    });
    return negative;
  }

  float distance(const Place& voxel) const
  {
    return field_.distance(static_cast<int>(voxel.x()), static_cast<int>(voxel.y()), static_cast<int>(voxel.z()));
  }

  /// True if one of the cells around a face or an edge is split. \param across bits of the axes that it is normal to
  bool isSplit(const Place& lowest, int level, int across) const
  {
    const Place cell(lowest.x() >> level, lowest.y() >> level, lowest.z() >> level);
    for (int bits = 0; bits < 8; ++bits)
      if ((bits & ~across) == 0 && has(octants_[level].split, cell - offset(bits)))
        return true;
    return false;
  }

private:
  static bool has(const VoxelSet& cells, const Place& cell)
  {
    return cells.contains(static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z()));
  }

  /// The voxels of a band as cells: the center of a coarser voxel lies in one cell of the same size.
  VoxelSet cellsOf(const DistanceField& band, const GridSize& grid) const
  {
    const Lattice &lattice = band.lattice(), &finest = field_.lattice();
    const Eigen::Array3i shift =
        ((lattice.origin - finest.origin) / lattice.spacing).array().floor().cast<int>() - gridMargin;
    const VoxelSet& voxels = band.banded()->band;
    return VoxelSet(grid, execution_, [&](int z, MaskPlane& mask) {
      voxels.forRuns(z - shift.z(), [&](const Run& run, int x, int y) {
        if (const int row = y + shift.y(); row >= 0 && row < grid.y)
          mask.setRange(x + shift.x(), x + shift.x() + run.count, row);
      });
    });
  }

  void findStored()
  {
    const GridSize size = field_.lattice().size;
    for (const DistanceField* band = &field_; band; band = band->coarserBand()) {
      const double side = band->lattice().spacing / field_.lattice().spacing;
      const auto level = static_cast<std::size_t>(std::lround(std::log2(side)));
      for (std::size_t n = octants_.size(); n <= level; ++n) {
        const GridSize grid{(size.x >> n) + 1, (size.y >> n) + 1, (size.z >> n) + 1};
        octants_.push_back({grid, VoxelSet(grid, execution_, [](int, MaskPlane&) {}), {}});
      }
      octants_[level].stored = cellsOf(*band, octants_[level].grid);
      execution_.poll();
    }
  }

  /// Keeps of a plane the cells all of whose corners are voxels of the lattice.
  void keepComplete(std::size_t level, int z, MaskPlane& mask) const
  {
    const GridSize& size = field_.lattice().size;
    if (z < (size.z - 1) >> level)
      mask.keepWithin(0, (size.x - 1) >> level, (size.y - 1) >> level);
    else
      mask.clear();
  }

  /// The cells of a plane inside larger stored cells.
  MaskPlane inLargerAt(std::size_t level, int z) const
  {
    MaskPlane inLarger(octants_[level].grid);
    for (std::size_t larger = level + 1; larger < octants_.size(); ++larger)
      addInside(octants_[larger].stored, static_cast<int>(larger - level), z, inLarger);
    return inLarger;
  }

  const DistanceField& field_;
  Execution& execution_;
  std::vector<Octants> octants_; ///< by level; level 0 has the finest voxels
};

/// The surface in some planes of cells of one level.
class PlaneMesher {
public:
  /// \param besideSmaller the cells of the level that touch smaller ones
  PlaneMesher(const Octree& octree, int level, int begin, int end, const VoxelSet& besideSmaller)
      : octree_(octree), crossings_(octree.field().lattice())
  {
    const GridSize& grid = octree[level].grid;
    CellPlane below{MaskPlane(grid), MaskPlane(grid)};
    MaskPlane negativeBelow(grid), seam(grid);
    for (int z = begin; z <= end; ++z) {
      CellPlane above = z < end ? octree.cellsAt(level, z) : CellPlane{MaskPlane(grid), MaskPlane(grid)};
      MaskPlane corners(above.cells);
      corners.unite(below.cells);
      if (!corners.empty()) {
        corners.growUpwards();
        MaskPlane negativeAbove = octree.negatives(level, z, corners);
        seam.clear();
        if (level > 0 && z > begin)
          besideSmaller.rasterize(z - 1, seam);
        addPlane(level, z - 1, below, seam, {{&negativeBelow, &negativeAbove}});
        negativeBelow = std::move(negativeAbove);
      }
      below = std::move(above);
    }
  }

  const TriangleMesh& mesh() const { return mesh_; }

  /// Calls visit(vertex, edge) for all vertices in order. A vertex inside a cell has no edge.
  template <typename Visit>
  void forVertices(const Visit& visit) const
  {
    std::size_t edge = 0;
    for (std::size_t vertex = 0; vertex < mesh_.vertices.size(); ++vertex) {
      const bool isOnEdge = edge < vertexOf_.size() && vertexOf_[edge] == static_cast<std::int32_t>(vertex);
      visit(mesh_.vertices[vertex], isOnEdge ? std::optional<Place>(edges_[edge++]) : std::nullopt);
    }
  }

private:
  void addPlane(int level, int z, const CellPlane& plane, const MaskPlane& seam, const CornerSigns& signs)
  {
    for (int y = 0; y + 1 < seam.rows(); ++y)
      for (int w = 0; plane.cells.isUsed(y) && w < seam.words(); ++w) {
        const Word own = plane.cells.row(y)[w];
        if (own == 0)
          continue;
        const CellWord corners(signs, w, y, 0);
        for (Word bits = own & (corners.cut | seam.row(y)[w]); bits != 0; bits &= bits - 1) {
          const int bit = __builtin_ctzll(bits), x = w * wordBits + bit;
          const Place lowest = sideOf(level) * Place(x, y, z);
          if (seam.has(x, y))
            addAtSeam(lowest, level);
          else if (level > 0 || plane.inLarger.has(x, y) || octree_.field().hasCell(x, y, z))
            addCase(corners.caseOf(bit), lowest, sideOf(level));
        }
      }
  }

  bool isNegative(const Place& voxel)
  {
    const std::uint32_t n = voxels_.add(voxel);
    if (n == areNegative_.size())
      areNegative_.push_back(octree_.distance(voxel) < 0 ? 1 : 0);
    return areNegative_[n] != 0;
  }

  /// The vertex between two voxels with different signs on a line along an axis.
  std::int32_t vertexBetween(const Place& a, const Place& b)
  {
    const Place low = a.min(b), high = a.max(b);
    const std::int64_t axis = low.x() < high.x() ? 0 : low.y() < high.y() ? 1 : 2;
    const std::uint32_t n = edges_.add(Place(3 * low.x() + axis, low.y(), low.z()));
    if (n == vertexOf_.size()) {
      vertexOf_.push_back(static_cast<std::int32_t>(mesh_.vertices.size()));
      mesh_.vertices.push_back(
          crossings_.position(low.cast<double>(), high.cast<double>(), octree_.distance(low), octree_.distance(high)));
    }
    return vertexOf_[n];
  }

  /// Adds the triangles of a cell that touches no smaller cells.
  void addCase(std::size_t signs, const Place& lowest, std::int64_t side)
  {
    const auto vertexOn = [&](std::uint8_t e) {
      const CellEdge edge = table_.edges[e];
      const Place start = lowest + side * offset(edge.corner);
      return vertexBetween(start, start + side * unit(edge.axis));
    };
    forTrianglesOf(table_.cases[signs], mesh_.vertices, vertexOn,
                   [&](const Triangle& triangle) { mesh_.triangles.push_back(triangle); });
  }

  /// A zero crossing on an edge of a cell: its vertex, and bits of the cell's faces that contain the vertex.
  struct Crossing {
    std::int32_t vertex = -1;
    int faces = 0;
  };

  /// Adds the triangles of a cell that touches smaller cells: its faces and edges are divided like theirs.
  void addAtSeam(const Place& lowest, int level)
  {
    segments_.clear();
    const std::int64_t side = sideOf(level);
    for (int face = 0; face < 6; ++face)
      addFace(lowest + face % 2 * side * unit(face / 2), level, face, {lowest, lowest + side});
    while (!segments_.empty()) {
      std::vector<Crossing> loop{segments_.back().first};
      Crossing next = segments_.back().second;
      segments_.pop_back();
      while (next.vertex != loop.front().vertex) {
        loop.push_back(next);
        const auto found = std::find_if(segments_.begin(), segments_.end(), [&](const auto& segment) {
          return segment.first.vertex == loop.back().vertex;
        });
        next = found->second;
        segments_.erase(found);
      }
      addLoop(loop);
    }
  }

  /// Two opposite corners of a cell.
  struct Ends {
    Place lowest, highest;
  };

  /// Adds the segments in a cell's face or a part of it; if a neighbor there is smaller, in each of its faces.
  void addFace(const Place& lowest, int level, int face, const Ends& cell)
  {
    const std::array<int, 4> corners = faceCorners(face / 2, face % 2);
    const int inFace = 7 & ~(1 << face / 2);
    if (level > 0 && octree_.isSplit(lowest, level, 1 << face / 2)) {
      for (const int bits : corners)
        addFace(lowest + sideOf(level - 1) * offset(bits & inFace), level - 1, face, cell);
      return;
    }
    nodes_.clear();
    for (std::size_t n = 0; n < 4; ++n)
      addNodes(lowest + sideOf(level) * offset(corners[n] & inFace),
               lowest + sideOf(level) * offset(corners[(n + 1) % 4] & inFace), level);
    addSegments(cell);
  }

  /// Adds the voxels on an edge from its start on, without its end.
  void addNodes(const Place& start, const Place& end, int level)
  {
    const Place way = end - start;
    const int along = way.x() != 0 ? 1 : way.y() != 0 ? 2 : 4;
    if (level > 0 && octree_.isSplit(start.min(end), level, 7 & ~along)) {
      const Place middle = start + way / 2;
      addNodes(start, middle, level - 1);
      addNodes(middle, end, level - 1);
    } else {
      nodes_.push_back(start);
    }
  }

  /// Each run of negative voxels around a face gets one segment, as in the table of cases.
  void addSegments(const Ends& cell)
  {
    const std::size_t count = nodes_.size();
    const auto isNegativeAt = [&](std::size_t n) { return isNegative(nodes_[n % count]); };
    for (std::size_t n = 0; n < count; ++n) {
      if (isNegativeAt(n) || !isNegativeAt(n + 1))
        continue;
      std::size_t last = n + 1;
      while (isNegativeAt(last + 1))
        ++last;
      segments_.emplace_back(crossingAfter(n, cell), crossingAfter(last, cell));
    }
  }

  Crossing crossingAfter(std::size_t n, const Ends& cell)
  {
    const Place &a = nodes_[n % nodes_.size()], &b = nodes_[(n + 1) % nodes_.size()];
    Crossing crossing{vertexBetween(a, b), 0};
    for (int axis = 0; axis < 3; ++axis) {
      const bool isAcross = a[axis] == b[axis];
      crossing.faces |= isAcross && a[axis] == cell.lowest[axis] ? 1 << 2 * axis : 0;
      crossing.faces |= isAcross && a[axis] == cell.highest[axis] ? 2 << 2 * axis : 0;
    }
    return crossing;
  }

  void addLoop(const std::vector<Crossing>& loop)
  {
    if (loop.size() < 3)
      return; // a line there and back along an edge crossed twice: its other cells meet there
    const LoopTriangles triangles = triangulateLoop(loop.size(), [&](std::size_t a, std::size_t b) {
      return loop[a].faces & loop[b].faces
                 ? infinity
                 : (mesh_.vertices[loop[a].vertex] - mesh_.vertices[loop[b].vertex]).squaredNorm();
    });
    for (const auto& [a, b, c] : triangles)
      mesh_.triangles.push_back({loop[a].vertex, loop[b].vertex, loop[c].vertex});
    if (!triangles.empty())
      return;
    const auto center = static_cast<std::int32_t>(mesh_.vertices.size());
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (std::size_t n = 0; n < loop.size(); ++n) {
      sum += mesh_.vertices[loop[n].vertex];
      mesh_.triangles.push_back({loop[n].vertex, loop[(n + 1) % loop.size()].vertex, center});
    }
    mesh_.vertices.push_back(sum / static_cast<float>(loop.size()));
  }

  const Octree& octree_;
  const EdgeCrossings crossings_;
  const CellTable& table_ = cubeTable();
  CellHash voxels_{Eigen::Vector3d::Zero(), 1}, edges_{Eigen::Vector3d::Zero(), 1}; ///< used so far
  std::vector<std::uint8_t> areNegative_;                                           ///< by number in voxels_
  std::vector<std::int32_t> vertexOf_;                                              ///< by number in edges_
  std::vector<Place> nodes_;                                                        ///< voxels around a face
  std::vector<std::pair<Crossing, Crossing>> segments_;
  TriangleMesh mesh_;
};

/// Appends the surfaces of planes one after the other. Vertices on the same edge become one vertex.
class JoinedPlanes {
public:
  /// \throw ResourceLimit
  void add(const PlaneMesher& planes)
  {
    if (mesh_.triangles.size() + planes.mesh().triangles.size() > std::numeric_limits<std::int32_t>::max() / 3)
      throw ResourceLimit("the zero level has more triangles than 32-bit indices can tell apart; use larger voxels");
    std::vector<std::int32_t> joined;
    planes.forVertices([&](const Eigen::Vector3f& vertex, const std::optional<Place>& edge) {
      const auto next = static_cast<std::int32_t>(mesh_.vertices.size());
      if (edge) {
        const std::size_t n = edges_.add(*edge);
        if (n < vertexOf_.size()) {
          joined.push_back(vertexOf_[n]);
          return;
        }
        vertexOf_.push_back(next);
      }
      joined.push_back(next);
      mesh_.vertices.push_back(vertex);
    });
    for (const Triangle& t : planes.mesh().triangles)
      mesh_.triangles.push_back({joined[t[0]], joined[t[1]], joined[t[2]]});
  }

  /// The mesh without unused vertices, and with one vertex for each fan of triangles.
  TriangleMesh mesh() const
  {
    TriangleMesh mesh = select(mesh_, std::vector<std::uint8_t>(mesh_.triangles.size(), 1));
    splitFans(mesh);
    return mesh;
  }

private:
  CellHash edges_{Eigen::Vector3d::Zero(), 1};
  std::vector<std::int32_t> vertexOf_; ///< by number in edges_
  TriangleMesh mesh_;
};

/// Planes of cells per PlaneMesher: few, so that every thread gets some; but neighbors repeat the plane between them.
constexpr int grainPlanes = 16;

} // namespace

TriangleMesh polygonizeOctree(const DistanceField& field, Execution& execution)
{
  const Octree octree(field, execution);
  JoinedPlanes joined;
  for (int level = 0; level < octree.levels(); ++level) {
    const Octants& cells = octree[level];
    const VoxelSet besideSmaller = level > 0 ? dilated(cells.split, 1, 1, execution) : cells.split;
    const auto meshPlanes = [&](std::unique_ptr<PlaneMesher>& planes, std::int64_t begin, std::int64_t end) {
      planes =
          std::make_unique<PlaneMesher>(octree, level, static_cast<int>(begin), static_cast<int>(end), besideSmaller);
    };
    for (auto& planes : partsOf<std::unique_ptr<PlaneMesher>>(execution, cells.grid.z - 1, grainPlanes, meshPlanes)) {
      joined.add(*planes);
      planes.reset();
    }
  }
  return joined.mesh();
}

} // namespace pcl::mrf

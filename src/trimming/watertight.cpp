// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/watertight.h"

#include "base/cell_hash.h"
#include "base/loops.h"
#include "field/field_contents.h"
#include "field/grid_transfer.h"
#include "mesh/mesh_topology.h"
#include "mesh/winding_number.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

namespace pcl::mrf {
namespace {

using VoxelIndex = CellHash::Cell;

/// Voxels added on each side of the field's lattice: a mesh that reaches its border is closed outside of it.
constexpr int voxelsAround = 2;

/// Distance in voxels per unit of the winding number: as steep as the field is at one voxel from a rim.
constexpr double steepness = 6.3;

/// Max number of triangles by which a hollow is told from a body.
constexpr std::size_t askedOfLevel = 4096;

Lattice withVoxelsAround(Lattice lattice)
{
  lattice.origin -= Eigen::Vector3d::Constant(voxelsAround * lattice.spacing);
  lattice.size = {lattice.size.x + 2 * voxelsAround, lattice.size.y + 2 * voxelsAround,
                  lattice.size.z + 2 * voxelsAround};
  return lattice;
}

Eigen::Vector3f centerOf(const TriangleMesh& mesh, const Triangle& t)
{
  return (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
}

/// A mesh bounds a hollow if it fills more than three quarters of the view from its outer side, in the mean: then the
/// mean of the winding numbers on its two sides is below this.
constexpr double ofHollow = -.25;

/// The level of the winding number that closes the mesh: halfway between the values on both sides of a closed mesh.
double levelOf(const TriangleMesh& mesh, const WindingNumber& winding, double voxelSize)
{
  const std::size_t step = mesh.triangles.size() / askedOfLevel + 1;
  double sum = 0, count = 0;
  for (std::size_t n = 0; n < mesh.triangles.size(); n += step) {
    const Triangle& t = mesh.triangles[n];
    const Eigen::Vector3f& a = mesh.vertices[t[0]];
    const Eigen::Vector3f normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).normalized(),
                          beside = static_cast<float>(voxelSize / 16) * normal, center = centerOf(mesh, t);
    sum += (winding.at(center - beside) + winding.at(center + beside)) / 2;
    ++count;
  }
  return sum < ofHollow * count ? -.5 : .5;
}

/// Voxels with their values, grown from the cells of a mesh along the sheet that closes it.
class ClosedBand {
public:
  ClosedBand(const TriangleMesh& mesh, const DistanceField& field, Execution& execution)
      : field_(field), lattice_(withVoxelsAround(field.lattice())), execution_(execution), winding_(mesh, execution),
        level_(levelOf(mesh, winding_, lattice_.spacing))
  {
    std::vector<VoxelIndex> cells;
    for (const Triangle& t : mesh.triangles) {
      const Eigen::Vector3d at = lattice_.toVoxels(centerOf(mesh, t));
      add(at.array().floor().cast<std::int64_t>(), cells);
    }
    for (const VoxelIndex& cell : cells)
      forCorners(cell, [&](const VoxelIndex& voxel) {
        if (voxels_.add(voxel) == values_.size())
          values_.push_back(field_.distance(static_cast<int>(voxel.x()) - voxelsAround,
                                            static_cast<int>(voxel.y()) - voxelsAround,
                                            static_cast<int>(voxel.z()) - voxelsAround));
      });
    std::size_t inMesh = cells_.size();
    while (!cells.empty()) {
      while (!cells.empty())
        cells = next(cells);
      addSurroundings(inMesh);
      inMesh = cells_.size();
      cells = missed();
    }
  }

  DistanceField field() const
  {
    const GridSize size = withMargin(lattice_.size);
    std::vector<std::vector<std::uint32_t>> ofPlane(size.z);
    for (std::uint32_t n = 0; n < values_.size(); ++n)
      ofPlane[voxels_[n].z() + gridMargin].push_back(n);
    const auto fill = [&](int z, MaskPlane& mask) {
      for (const std::uint32_t n : ofPlane[z])
        mask.set(static_cast<int>(voxels_[n].x()) + gridMargin, static_cast<int>(voxels_[n].y()) + gridMargin);
    };
    auto banded = std::make_shared<BandedDistances>();
    banded->band = VoxelSet(size, execution_, fill);
    banded->values.resize(values_.size());
    forEach(execution_, values_.size(), grain, [&](std::size_t n) {
      const VoxelIndex at = voxels_[n] + gridMargin;
      banded->values[banded->band.find(static_cast<int>(at.x()), static_cast<int>(at.y()), static_cast<int>(at.z()))] =
          values_[n];
    });
    banded->background = field_;
    return DistanceField(lattice_, std::move(banded));
  }

private:
  static constexpr std::int64_t grain = 1024;

  template <typename Visit>
  static void forCorners(const VoxelIndex& cell, const Visit& visit)
  {
    for (int n = 0; n < 8; ++n)
      visit(VoxelIndex(cell + VoxelIndex(n & 1, n >> 1 & 1, n >> 2)));
  }

  /// Adds a cell to a list, unless it was added to one before.
  void add(const VoxelIndex& cell, std::vector<VoxelIndex>& cells)
  {
    if (const std::size_t before = cells_.size(); cells_.add(cell) == before)
      cells.push_back(cell);
  }

  /// Adds the corners of a cell to the voxels.
  void addCorners(const VoxelIndex& cell)
  {
    forCorners(cell, [&](const VoxelIndex& voxel) {
      if (voxels_.add(voxel) == values_.size())
        values_.push_back(0);
    });
  }

  /// Sets the values of the voxels from this number on. In two layers at the lattice's border the winding number is set
  /// to 0, as far from the mesh, so that the sheet stays in the lattice however inexact the winding numbers are.
  void evaluate(std::size_t first)
  {
    forEachPolling<std::size_t>(execution_, values_.size() - first, grain, [&](std::size_t n) {
      const VoxelIndex at = voxels_[first + n];
      const int i = static_cast<int>(at.x()), j = static_cast<int>(at.y()), k = static_cast<int>(at.z());
      const double turns = lattice_.size.contains(i - 2, j - 2, k - 2) && lattice_.size.contains(i + 2, j + 2, k + 2)
                               ? winding_.at(lattice_.position(i, j, k))
                               : 0;
      values_[first + n] = static_cast<float>(steepness * lattice_.spacing * (level_ - turns));
    });
  }

  /// Sets the values at the corners of cells that the zero level cuts. \return the new cells beside them that it cuts
  std::vector<VoxelIndex> next(const std::vector<VoxelIndex>& cells)
  {
    const std::size_t first = values_.size();
    for (const VoxelIndex& cell : cells)
      addCorners(cell);
    evaluate(first);
    std::vector<VoxelIndex> result;
    for (const VoxelIndex& cell : cells)
      for (int axis = 0; axis < 3; ++axis)
        for (const int side : {0, 1}) {
          int negative = 0;
          forCorners(cell, [&](const VoxelIndex& voxel) {
            negative += voxel[axis] == cell[axis] + side && values_[voxels_.find(voxel)] < 0;
          });
          VoxelIndex beside = cell;
          beside[axis] += 2 * side - 1;
          if (negative % 4 != 0)
            add(beside, result);
        }
    return result;
  }

  /// Sets the values around the cells from this number on, so that the field has gradients there.
  void addSurroundings(std::size_t first)
  {
    const std::size_t before = values_.size();
    for (std::size_t n = first; n < cells_.size(); ++n)
      CellHash::forEachAround(cells_[n], [&](const VoxelIndex& cell) {
        if ((cell >= 0).all())
          addCorners(cell);
      });
    evaluate(before);
  }

  /// Cells that were not added yet, whose corners are all known, and which the zero level cuts.
  std::vector<VoxelIndex> missed()
  {
    std::vector<VoxelIndex> result;
    for (std::size_t n = 0; n < voxels_.size(); ++n) {
      const VoxelIndex cell = voxels_[n];
      if (cells_.find(cell) != CellHash::none)
        continue;
      bool areKnown = true;
      int negative = 0;
      forCorners(cell, [&](const VoxelIndex& voxel) {
        const std::uint32_t number = voxels_.find(voxel);
        areKnown = areKnown && number != CellHash::none;
        negative += areKnown && values_[number] < 0;
      });
      if (areKnown && negative % 8 != 0)
        add(cell, result);
    }
    return result;
  }

  const DistanceField& field_;
  const Lattice lattice_;
  Execution& execution_;
  const WindingNumber winding_;
  const double level_;
  CellHash voxels_{Eigen::Vector3d::Zero(), 1}, cells_{Eigen::Vector3d::Zero(), 1};
  std::vector<float> values_; ///< of the voxels, by their numbers
};

/// The triangles whose centers lie in the cells of a lattice.
TriangleMesh partIn(const Lattice& lattice, const TriangleMesh& mesh, Execution& execution)
{
  const Eigen::AlignedBox3d box(Eigen::Vector3d::Zero(),
                                Eigen::Vector3d(lattice.size.x, lattice.size.y, lattice.size.z));
  std::vector<std::uint8_t> isIn(mesh.triangles.size());
  forTriangles(mesh, execution,
               [&](std::size_t t) { isIn[t] = box.contains(lattice.toVoxels(centerOf(mesh, mesh.triangles[t]))); });
  return select(mesh, isIn);
}

} // namespace

DistanceField closeOpenings(const TriangleMesh& mesh, const DistanceField& field, Execution& execution)
{
  if (field.otherPieces().empty())
    return ClosedBand(mesh, field, execution).field();
  std::vector<DistanceField> closed;
  const auto close = [&](const DistanceField& piece) {
    const TriangleMesh part = partIn(piece.lattice(), mesh, execution);
    if (!part.triangles.empty())
      closed.push_back(ClosedBand(part, piece, execution).field());
  };
  close(field);
  for (const DistanceField& piece : field.otherPieces())
    close(piece);
  return DistanceField::ofPieces(std::move(closed));
}

} // namespace pcl::mrf

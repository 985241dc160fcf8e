// SPDX-License-Identifier: BSD-3-Clause
#include "field/field_contents.h"

#include "field/grid_transfer.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace pcl::mrf {
namespace {

/// Voxels of the band's grid along an axis, [first, last].
struct Range {
  int first, last;
  bool has(int index) const { return index >= first && index <= last; }
};

/// The voxels that are read for positions in a box: those of their cells, and one voxel more for differences.
Range rangeOf(const Lattice& lattice, const Eigen::AlignedBox3d& box, int axis)
{
  constexpr double readAround = 2;
  const double first = (box.min()[axis] - lattice.origin[axis]) / lattice.spacing,
               last = (box.max()[axis] - lattice.origin[axis]) / lattice.spacing;
  const auto voxel = [](double index) { return static_cast<int>(std::clamp(index, -1e9, 1e9)) + gridMargin; };
  return {voxel(std::floor(first) - readAround), voxel(std::ceil(last) + readAround)};
}

/// The voxels of a band in the given rows of the given planes.
VoxelSet rowsOf(const VoxelSet& band, const Range& rows, const Range& planes, Execution& execution)
{
  return VoxelSet(band.size(), execution, [&](int z, MaskPlane& mask) {
    if (!planes.has(z))
      return;
    for (int y = std::max(rows.first, 0); y <= std::min(rows.last, mask.rows() - 1); ++y)
      for (const Run& run : band.row(y, z))
        mask.setRange(band.xOf(run, y), band.xOf(run, y) + run.count, y);
  });
}

} // namespace

FieldContents FieldContents::ofPiece(const DistanceField& piece, const Eigen::AlignedBox3d& box, Execution& execution)
{
  FieldContents contents;
  contents.lattice = piece.stored_;
  contents.axes = piece.axes_;
  contents.distances = piece.distances_;
  if (!piece.banded_)
    return contents;
  const BandedDistances& banded = *piece.banded_;
  const Eigen::AlignedBox3d stored(piece.axes_.toStored(box.min().eval()), piece.axes_.toStored(box.max().eval()));
  contents.background.push_back(ofPiece(banded.background, stored, execution));
  contents.band = rowsOf(banded.band, rangeOf(piece.stored_, stored, 1), rangeOf(piece.stored_, stored, 2), execution);
  contents.values.reserve(contents.band.count());
  for (int z = contents.band.bottom(); z < contents.band.top(); ++z)
    forEachPair(contents.band, banded.band, z, [&](std::int64_t, std::int64_t first, std::int64_t count) {
      const auto from = banded.values.begin() + first;
      contents.values.insert(contents.values.end(), from, from + count);
    });
  return contents;
}

std::vector<FieldContents> FieldContents::of(const DistanceField& field, const Eigen::AlignedBox3d& box,
                                             Execution& execution)
{
  std::vector<FieldContents> pieces{ofPiece(field, box, execution)};
  for (const DistanceField& piece : field.otherPieces())
    pieces.push_back(ofPiece(piece, box, execution));
  return pieces;
}

DistanceField FieldContents::toPiece() &&
{
  if (background.empty())
    return DistanceField(lattice, std::move(distances), {});
  return DistanceField(lattice,
                       std::make_shared<BandedDistances>(BandedDistances{
                           std::move(band), std::move(values), {}, std::move(background.front()).toPiece()}),
                       axes);
}

DistanceField FieldContents::toField(std::vector<FieldContents> pieces)
{
  std::vector<DistanceField> fields;
  for (FieldContents& piece : pieces)
    fields.push_back(std::move(piece).toPiece());
  return DistanceField::ofPieces(std::move(fields));
}

} // namespace pcl::mrf

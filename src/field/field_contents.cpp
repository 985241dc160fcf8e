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

/// Those that are read within a box: cells around positions, and a voxel more for differences.
Range rangeOf(const Lattice& lattice, const Eigen::AlignedBox3d& box, int axis)
{
  constexpr double readAround = 2;
  const double first = (box.min()[axis] - lattice.origin[axis]) / lattice.spacing,
               last = (box.max()[axis] - lattice.origin[axis]) / lattice.spacing;
  const auto voxel = [](double index) { return static_cast<int>(std::clamp(index, -1e9, 1e9)) + gridMargin; };
  return {voxel(std::floor(first) - readAround), voxel(std::ceil(last) + readAround)};
}

/// The voxels of a band in some rows of some planes.
VoxelSet rowsOf(const VoxelSet& band, const Range& rows, const Range& planes, Execution& execution)
{
  return VoxelSet(
      band.size(),
      [&](int z, MaskPlane& mask) {
        if (!planes.has(z))
          return;
        for (int y = std::max(rows.first, 0); y <= std::min(rows.last, mask.rows() - 1); ++y)
          for (const Run& run : band.row(y, z))
            mask.setRange(band.xOf(run, y), band.xOf(run, y) + run.count, y);
      },
      0, execution);
}

} // namespace

std::vector<FieldContents> FieldContents::of(const DistanceField& field, const Eigen::AlignedBox3d& box,
                                             Execution& execution)
{
  std::vector<FieldContents> pieces;
  const auto add = [&](const DistanceField& piece) {
    FieldContents contents;
    contents.lattice = piece.stored_;
    contents.axes = piece.axes_;
    contents.isBanded = piece.banded_ != nullptr;
    if (contents.isBanded) {
      const BandedDistances& banded = *piece.banded_;
      const Eigen::AlignedBox3d stored(piece.axes_.toStored(box.min().eval()), piece.axes_.toStored(box.max().eval()));
      contents.ofBackground = banded.background.stored_;
      contents.distances = banded.background.distances_;
      contents.band =
          rowsOf(banded.band, rangeOf(piece.stored_, stored, 1), rangeOf(piece.stored_, stored, 2), execution);
      contents.values.reserve(contents.band.count());
      for (int z = contents.band.bottom(); z < contents.band.top(); ++z)
        forEachPair(contents.band, banded.band, z, [&](std::int64_t, std::int64_t first, std::int64_t count) {
          const auto values = banded.values.begin() + first;
          contents.values.insert(contents.values.end(), values, values + count);
        });
    } else {
      contents.distances = piece.distances_;
    }
    pieces.push_back(std::move(contents));
  };
  add(field);
  for (const DistanceField& piece : field.otherPieces())
    add(piece);
  return pieces;
}

DistanceField FieldContents::toField(std::vector<FieldContents> pieces)
{
  std::vector<DistanceField> fields;
  for (FieldContents& piece : pieces) {
    if (!piece.isBanded) {
      fields.emplace_back(piece.lattice, std::move(piece.distances), std::vector<float>());
      continue;
    }
    auto banded = std::make_shared<BandedDistances>();
    banded->background = DistanceField(piece.ofBackground, std::move(piece.distances), {});
    banded->band = std::move(piece.band);
    banded->values = std::move(piece.values);
    fields.emplace_back(piece.lattice, std::move(banded), piece.axes);
  }
  return DistanceField::ofPieces(std::move(fields));
}

} // namespace pcl::mrf

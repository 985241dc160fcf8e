// SPDX-License-Identifier: BSD-3-Clause
#include "run/cloud_pieces.h"

#include "options/stage_timer.h"
#include "pilot/volume.h"
#include "run/pieces.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

namespace pcl::mrf {
namespace {

void dropAlone(const std::vector<std::uint32_t>& alone, OrientedPoints& points, NeighborSearch& search, Report& report,
               Execution& execution)
{
  if (alone.empty())
    return;
  std::vector<std::uint8_t> keep(points.size(), 1);
  for (const std::uint32_t i : alone)
    keep[i] = 0;
  points = select(std::move(points), keep);
  search.dropPoints(points.positions, keep, execution);
  report.points.alone = static_cast<std::int64_t>(alone.size());
  report.points.used -= report.points.alone;
}

} // namespace

CloudPieces::CloudPieces(OrientedPoints& points, NeighborSearch& search, const Options& options, Report& report,
                         Execution& execution)
{
  // A gap between pieces must exceed the holes to fill, and the boxes with their padding must not overlap.
  const auto voxels = static_cast<float>(8 * (resolvedPadding(options.multiscale) + 2));
  const float minGap = std::max(options.trimming.maxHole, voxels * options.multiscale.voxelSize);
  const Pieces found = findPieces(points.positions, minGap);
  if (found.points.size() > 1)
    for (const std::vector<std::uint32_t>& piece : found.points) {
      points_.push_back(select(points, piece));
      searches_.push_back(makeSearch(options.search));
      searches_.back()->setPoints(points_.back().positions, execution);
    }
  dropAlone(found.alone, points, search, report, execution);
  for (std::size_t n = 0; n < points_.size(); ++n)
    pieces_.push_back({&points_[n], searches_[n].get(), boundingBox(points_[n].positions)});
  if (pieces_.empty())
    pieces_.push_back({&points, &search, boundingBox(points.positions)});
}

float CloudPieces::largestDiagonal() const
{
  float largest = 0;
  for (const SolvedPiece& piece : pieces_)
    largest = std::max(largest, boundingBox(piece.points->positions).diagonal());
  return largest;
}

void CloudPieces::growVolumes(const Options& options, Report& report, Execution& execution)
{
  if (options.multiscale.padding > 0)
    return;
  const StageTimer timer("volume", report, execution);
  const float maxHole =
      options.trimming.kind == Trimming::none ? std::numeric_limits<float>::infinity() : options.trimming.maxHole;
  for (SolvedPiece& piece : pieces_)
    piece.volume = chooseVolume(*piece.points, *piece.search, report.density.spacing, options, maxHole, execution);
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "levels/tiled_band.h"

#include "levels/tile_task.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

/// Planes around a tile whose changes are continued into it, and that show whether its zero level touches the rim.
constexpr int continuedFrom = 8;

/// Planes [begin, end).
struct Planes {
  int begin = 0, end = 0;
  int count() const { return end - begin; }
};

/// Some planes of a lattice as a lattice of their own.
Lattice cut(const Lattice& lattice, const Planes& planes)
{
  Lattice result = lattice;
  result.size.z = planes.count();
  result.origin.z() += lattice.spacing * planes.begin;
  return result;
}

PackedValues cut(const VoxelSet& set, const PackedValues& values, int first, int count)
{
  return PackedValues(values.begin() + set.planeFirst(first), values.begin() + set.planeFirst(first + count));
}

/// The place of a tile. Grids have a margin around their lattice: plane z of the tile's grid is plane z + fine.begin of
/// the whole grid.
struct TilePlace {
  Planes coarse, fine; ///< of both lattices, with the halo
  Planes own;          ///< without the halo, as planes of the tile's grid on the finest level
};

/// Voxels of consecutive planes.
struct TileVoxels {
  VoxelSet voxels;
  int first = 0; ///< plane of the whole grid that is plane 0 of the voxels
};

/// The same with values.
struct TileValues : TileVoxels {
  PackedValues values; ///< packed
};

/// Sums over tiles for the report.
struct TileSums {
  int iterations = 0;
  double decrease = 0, curvature = 0;
  double unknowns = 0, squaredResidual = 0, squaredChange = 0, squaredChangeOfFillings = 0;
};

class TiledBand {
public:
  TiledBand(const TiledLevel& level, const LevelField& coarse, const LevelPlan& plan, const SolverOptions& solver,
            LevelReport& report, Execution& execution)
      : level_(level), coarse_(coarse), plan_(plan), solver_(solver), report_(report), execution_(execution),
        refinement_(coarse.lattice, level.points.lattice), places_(choosePlaces())
  {}

  LevelField solve()
  {
    for (int round = 0;; ++round) {
      solveTiles();
      takeStepsOfOneLength();
      std::vector<TileValues> fields;
      const bool missesSheet = continueTiles(fields);
      if (round + 1 < maxBandRounds && missesSheet)
        continue;
      summarize();
      changes_.clear();
      found_.clear();
      return joined(std::move(fields));
    }
  }

private:
  void solveTiles()
  {
    sums_ = TileSums();
    lengths_.clear();
    changes_.clear();
    observed_.clear();
    report_.observed = 0;
    const auto count = static_cast<int>(places_.size());
    pcl::mrf::solveTiles(
        count, [this](int n) { return inputOf(places_[n]); },
        [&](int n, TileResult result) {
          keep(places_[n], std::move(result));
          execution_.progress(.8 * (n + 1) / count);
        },
        execution_);
    report_.solve.iterations += sums_.iterations;
  }

  /// Scales the changes of the tiles from steps of their own lengths to the step of the whole level.
  void takeStepsOfOneLength()
  {
    const double length = sums_.curvature > 0 ? sums_.decrease / sums_.curvature : 0;
    for (std::size_t n = 0; n < places_.size(); ++n)
      if (lengths_[n] > 0)
        for (float& change : changes_[n].values)
          change *= static_cast<float>(length / lengths_[n]);
  }

  /// Makes the fields of the tiles' own planes. \return true if the coarser level has missed a sheet
  bool continueTiles(std::vector<TileValues>& fields)
  {
    RimCounts counts;
    std::vector<TileVoxels> found;
    for (std::size_t n = 0; n < places_.size(); ++n) {
      const TilePlace& place = places_[n];
      LevelField field = continued(place);
      field.observed = std::move(observed_[n]);
      fields.push_back(
          {ownPlanes(place, field.support), cut(field.support, field.values, place.own.begin, place.own.count())});
      const VoxelSet solved = zeroLevelAtData(field, place.own.begin, place.own.end, execution_);
      const RimCounts own = rimCounts(field.unknowns, solved, execution_);
      counts.zeroLevel += own.zeroLevel;
      counts.touching += own.touching;
      found.push_back(ownPlanes(place, united(foundBefore(place), solved, execution_)));
      for (std::size_t next = n + 1, done = 0; next < changes_.size() && done <= n; ++done)
        if (changes_[done].first + changes_[done].voxels.size().z <= changes_[next].first - continuedFrom)
          changes_[done].values = PackedValues(); // no other tile needs them any more
    }
    found_ = std::move(found);
    return counts.missSheet();
  }

  const Lattice& fine() const { return level_.points.lattice; }

  /// The first plane of the finer lattice that lies in a plane of the coarser one.
  int firstChild(int plane) const
  {
    if (plane >= coarse_.lattice.size.z)
      return fine().size.z;
    return std::clamp(refinement_.firstChild(plane + gridMargin, 2) - gridMargin, 0, fine().size.z);
  }

  TilePlace placeOf(const Planes& own) const
  {
    TilePlace place;
    place.coarse = {std::max(own.begin - tileHalo / 2, 0), std::min(own.end + tileHalo / 2, coarse_.lattice.size.z)};
    place.fine = {firstChild(place.coarse.begin), firstChild(place.coarse.end)};
    // The margin belongs to the tiles at the ends.
    place.own.begin = own.begin == 0 ? 0 : firstChild(own.begin) - place.fine.begin + gridMargin;
    place.own.end = own.end == coarse_.lattice.size.z ? place.fine.count() + 2 * gridMargin
                                                      : firstChild(own.end) - place.fine.begin + gridMargin;
    return place;
  }

  /// Tiles with about equal numbers of unknowns, as the coarser level predicts them.
  std::vector<TilePlace> choosePlaces() const
  {
    const VoxelSet& unknowns = coarse_.unknowns;
    std::vector<TilePlace> places;
    const int planes = coarse_.lattice.size.z;
    Planes own;
    for (int tile = 1; tile <= level_.tiles; ++tile) {
      const std::int64_t share = unknowns.count() * tile / level_.tiles;
      while (own.end < planes && (tile == level_.tiles || unknowns.planeFirst(own.end + gridMargin) < share))
        ++own.end;
      if (own.count() > 0)
        places.push_back(placeOf(own));
      own.begin = own.end;
    }
    return places;
  }

  /// The coarser field around a tile, without its observed voxels, which the finest level does not need.
  LevelField coarseOf(const TilePlace& place) const
  {
    const int first = place.coarse.begin, count = place.coarse.count() + 2 * gridMargin;
    LevelField field;
    field.lattice = cut(coarse_.lattice, place.coarse);
    field.unknowns = cutPlanes(coarse_.unknowns, first, count, execution_);
    field.support = cutPlanes(coarse_.support, first, count, execution_);
    field.values = cut(coarse_.support, coarse_.values, first, count);
    if (coarse_.left.count() > 0)
      field.left = cutPlanes(coarse_.left, first, count, execution_);
    return field;
  }

  /// The points in the cells of a tile and its halo.
  std::vector<std::uint32_t> pointsOf(const TilePlace& place) const
  {
    const PointsOnLattice& all = level_.points;
    const double lower = place.fine.begin, upper = place.fine.end - 1;
    const bool isFirst = place.fine.begin == 0, isLast = place.fine.end == fine().size.z;
    std::vector<std::uint32_t> chosen;
    for (std::size_t i = 0; i < all.points.size(); ++i) {
      const double z = all.lattice.toVoxels(all.axes.toStored(all.points.positions[i])).z();
      if ((isFirst || z >= lower + .5) && (isLast || z < upper - .5))
        chosen.push_back(static_cast<std::uint32_t>(i));
    }
    return chosen;
  }

  VoxelSet foundBefore(const TilePlace& place) const { return gathered(place, {0, gridOf(place).z}, found_); }

  TileInput inputOf(const TilePlace& place) const
  {
    TileInput input;
    input.lattices = {cut(coarse_.lattice, place.coarse), cut(fine(), place.fine)};
    input.coarse = coarseOf(place);
    const std::vector<std::uint32_t> chosen = pointsOf(place);
    PointsOnLattice seen = level_.points;
    seen.chosen = &chosen;
    seen.firstPlane = place.fine.begin;
    input.samples = samplesOfFinest(seen, execution_);
    input.weights = level_.weights;
    input.prior = level_.prior;
    input.plan = plan_;
    input.solver = solver_;
    input.tile = {place.fine.begin > 0, place.fine.end < fine().size.z, foundBefore(place), {}};
    input.tile.step.begin = place.own.begin;
    input.tile.step.end = place.own.end;
    return input;
  }

  void keep(const TilePlace& place, TileResult result)
  {
    const auto unknowns = static_cast<double>(result.changed.count());
    report_.observed += result.observed.planeFirst(place.own.end) - result.observed.planeFirst(place.own.begin);
    changes_.push_back({{std::move(result.changed), place.fine.begin + place.own.begin}, std::move(result.change)});
    observed_.push_back(std::move(result.observed));
    lengths_.push_back(result.step.length);
    const SolveReport& solve = result.solve;
    sums_.iterations = std::max(sums_.iterations, solve.iterations);
    sums_.decrease += result.step.decrease;
    sums_.curvature += result.step.curvature;
    sums_.unknowns += unknowns;
    sums_.squaredResidual += unknowns * std::pow(solve.relativeResidual, 2);
    sums_.squaredChange += unknowns * std::pow(solve.remainingChange, 2);
    sums_.squaredChangeOfFillings += unknowns * std::pow(solve.remainingChangeOfFillings, 2);
  }

  void summarize()
  {
    const double unknowns = std::max(sums_.unknowns, 1.);
    report_.unknowns = static_cast<std::int64_t>(sums_.unknowns);
    report_.solve.relativeResidual = std::sqrt(sums_.squaredResidual / unknowns);
    report_.solve.remainingChange = std::sqrt(sums_.squaredChange / unknowns);
    report_.solve.remainingChangeOfFillings = std::sqrt(sums_.squaredChangeOfFillings / unknowns);
    report_.solve.converged = report_.solve.remainingChange <= changeLeftInBands;
    report_.solve.history.assign(1, report_.solve.relativeResidual);
  }

  GridSize gridOf(const TilePlace& place) const
  {
    const GridSize whole = withMargin(fine().size);
    return {whole.x, whole.y, place.fine.count() + 2 * gridMargin};
  }

  /// The tile's own planes of a set on its grid.
  TileVoxels ownPlanes(const TilePlace& place, const VoxelSet& set) const
  {
    return {cutPlanes(set, place.own.begin, place.own.count(), execution_), place.fine.begin + place.own.begin};
  }

  /// The voxels of all tiles on some planes of a tile's grid.
  template <typename Tile>
  VoxelSet gathered(const TilePlace& place, const Planes& planes, const std::vector<Tile>& tiles) const
  {
    return VoxelSet(gridOf(place), execution_, [&](int z, MaskPlane& mask) {
      if (z >= planes.begin && z < planes.end)
        if (const Tile* from = ownerOf(z + place.fine.begin, tiles))
          from->voxels.rasterize(z + place.fine.begin - from->first, mask);
    });
  }

  /// The field of a tile's own planes and of some around them, with the changes of all tiles.
  LevelField continued(const TilePlace& place) const
  {
    const Planes near{std::max(place.own.begin - continuedFrom, 0),
                      std::min(place.own.end + continuedFrom, gridOf(place).z)};
    VoxelSet unknowns = gathered(place, near, changes_);
    PackedValues change;
    change.reserve(unknowns.count());
    for (int z = near.begin; z < near.end; ++z)
      if (const TileValues* from = ownerOf(z + place.fine.begin, changes_)) {
        const int plane = z + place.fine.begin - from->first;
        change.insert(change.end(), from->values.begin() + from->voxels.planeFirst(plane),
                      from->values.begin() + from->voxels.planeFirst(plane + 1));
      }
    return fieldOfChange(coarseOf(place), cut(fine(), place.fine), std::move(unknowns), change, order(level_.prior),
                         execution_);
  }

  /// The tile that owns a plane of the whole grid; null if none does.
  template <typename Tile>
  static const Tile* ownerOf(int plane, const std::vector<Tile>& tiles)
  {
    const auto after =
        std::upper_bound(tiles.begin(), tiles.end(), plane, [](int z, const Tile& tile) { return z < tile.first; });
    if (after == tiles.begin() || plane >= (after - 1)->first + (after - 1)->voxels.size().z)
      return nullptr;
    return &*(after - 1);
  }

  LevelField joined(std::vector<TileValues> tiles) const
  {
    LevelField field;
    field.lattice = fine();
    field.support = VoxelSet(withMargin(fine().size), execution_, [&](int z, MaskPlane& mask) {
      if (const TileValues* from = ownerOf(z, tiles))
        from->voxels.rasterize(z - from->first, mask);
    });
    field.values.reserve(field.support.count());
    for (TileValues& tile : tiles) {
      field.values.insert(field.values.end(), tile.values.begin(), tile.values.end());
      tile = TileValues();
    }
    return field;
  }

  const TiledLevel& level_;
  const LevelField& coarse_;
  const LevelPlan& plan_;
  const SolverOptions& solver_;
  LevelReport& report_;
  Execution& execution_;
  Refinement refinement_;
  std::vector<TilePlace> places_;
  std::vector<TileVoxels> found_;   ///< the zero level at data so far, per tile
  std::vector<VoxelSet> observed_;  ///< on the grids of the tiles
  std::vector<TileValues> changes_; ///< of the unknowns, per tile
  std::vector<double> lengths_;     ///< of the steps that the tiles took
  TileSums sums_;
};

} // namespace

LevelField solveInTiles(const TiledLevel& level, const LevelField& coarse, const LevelPlan& plan,
                        const SolverOptions& solver, LevelReport& report, Execution& execution)
{
  return TiledBand(level, coarse, plan, solver, report, execution).solve();
}

} // namespace pcl::mrf

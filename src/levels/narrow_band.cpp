// SPDX-License-Identifier: BSD-3-Clause
#include "levels/narrow_band.h"

#include "base/loops.h"
#include "field/prior.h"

#include <pcl/surface/mrf/report.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <memory>

namespace pcl::mrf {
namespace {

/// Voxels at the zero level grow into a band by a box of one voxel and by this many crosses: near data, far from data,
/// and on a dense level. What fills a hole moves on coarser levels and hardly on the finest one: with as much room
/// there a street takes .14 more time, and holes of six scans of 150,000 points are 1.017 times as far from the truth.
constexpr int crossesNearData = 1, crossesFarFromData = 5, crossesOfDense = 4;

/// Crosses near data where the finest level is the only one in a band.
constexpr int crossesOfOnlyBand = 3;

/// Near data is what is at most this many voxels of the coarser level away from one that is observed there.
constexpr int nearData = 2;

/// Voxels around the wanted part of a level's surface that finer levels still solve: trimming closes gaps by 7 voxels
/// of the finest level from either side even where coarser levels see no surface to be kept.
constexpr int nearWanted = 4;

/// Voxels around dense points that finer levels resolve, too. With 4, what a depth camera saw of a room is 3 % farther
/// from the truth, with 8 a street takes .07 more time.
constexpr int aroundDense = 6;

/// Finer levels leave out what they need not resolve if it is more than this share of a level. Less is not worth the
/// seams.
constexpr double worthLeaving = .4;

/// Voxels stored around a surface that finer levels leave out, so that it has gradients.
constexpr int aroundLeft = 2;

/// Max change of the interpolated field by a level, in its voxel sides: one side of the coarser level. Beyond the last
/// point, at the seam to what is left out, nothing holds a band's border, and few steps may move it by dozens of
/// voxels.
constexpr float farthestMove = 2;

/// Voxels around the unknowns of a level that the interpolation to the next level reads: half as many as the support of
/// that level has, and two for the taps of the cubic. Along x its runs are up to 7 voxels longer.
constexpr int interpolationReach = 4, interpolationReachX = 11;

/// Signs of one plane of a field on a band.
struct SignPlane {
  MaskPlane known, negative;

  explicit SignPlane(GridSize size) : known(size), negative(size) {}

  void fill(const VoxelSet& band, const float* values, int z)
  {
    known.clear();
    negative.clear();
    band.rasterize(z, known);
    band.forRuns(z, [&](const Run& run, int x, int y) {
      setNegativeBits(negative.row(y), x, x + run.count, values + band.planeFirst(z) + run.first);
    });
  }
};

/// Combines two sets plane by plane. \param operation of MaskPlane: on a plane of `a`, with that of `b`
VoxelSet combined(const VoxelSet& a, const VoxelSet& b, void (MaskPlane::*operation)(const MaskPlane&),
                  Execution& execution)
{
  return VoxelSet(a.size(), execution, [&](int z, MaskPlane& mask) {
    MaskPlane other(b.size());
    a.rasterize(z, mask);
    b.rasterize(z, other);
    (mask.*operation)(other);
  });
}

VoxelSet common(const VoxelSet& a, const VoxelSet& b, Execution& execution)
{
  return combined(a, b, &MaskPlane::intersect, execution);
}

VoxelSet without(const VoxelSet& a, const VoxelSet& b, Execution& execution)
{
  return combined(a, b, &MaskPlane::subtract, execution);
}

/// The values on a part of a set, packed.
PackedValues valuesOn(const VoxelSet& part, const VoxelSet& whole, const PackedValues& values)
{
  PackedValues result(part.count());
  for (int z = 0; z < part.size().z; ++z)
    forEachPair(part, whole, z, [&](std::int64_t inner, std::int64_t outer, std::int64_t count) {
      std::copy_n(values.begin() + outer, count, result.begin() + inner);
    });
  return result;
}

/// Marks the voxels of a plane that have a neighbor of the other sign. Keeps three planes of signs from call to call.
class CrossingFinder {
public:
  CrossingFinder(const VoxelSet& band, const float* values)
      : band_(&band), values_(values), planes_(3, SignPlane(band.size()))
  {}

  void operator()(int z, MaskPlane& mask)
  {
    if (z != next_) {
      planes_[1].fill(*band_, values_, z - 1);
      planes_[2].fill(*band_, values_, z);
    }
    std::rotate(planes_.begin(), planes_.begin() + 1, planes_.end());
    planes_[2].fill(*band_, values_, z + 1);
    next_ = z + 1;
    const SignPlane &below = planes_[0], &own = planes_[1], &above = planes_[2];
    const int words = mask.words(), rows = band_->size().y;
    for (int y = 0; y < rows; ++y) {
      if (!own.known.isUsed(y))
        continue;
      std::uint64_t* const out = mask.row(y);
      const std::uint64_t *known = own.known.row(y), *negative = own.negative.row(y);
      const auto mark = [&](const SignPlane& other, int row) {
        for (int w = 0; w < words; ++w)
          out[w] |= (negative[w] ^ other.negative.row(row)[w]) & known[w] & other.known.row(row)[w];
      };
      mark(below, y);
      mark(above, y);
      if (y > 0)
        mark(own, y - 1);
      if (y + 1 < rows)
        mark(own, y + 1);
      for (int w = 0; w < words; ++w) {
        const std::uint64_t cut = (negative[w] ^ nextBits(negative, w, words)) & known[w] & nextBits(known, w, words);
        out[w] |= cut | cut << 1;
        if (w + 1 < words)
          out[w + 1] |= cut >> (MaskPlane::wordBits - 1);
      }
    }
  }

private:
  const VoxelSet* band_;
  const float* values_;
  std::vector<SignPlane> planes_;
  int next_ = std::numeric_limits<int>::min();
};

/// Both ends of all edges of the lattice whose ends have different signs.
VoxelSet crossings(const VoxelSet& band, const PackedValues& values, Execution& execution)
{
  return VoxelSet::inPieces(band.size(), execution,
                            [&]() -> VoxelSet::Fill { return CrossingFinder(band, values.data()); });
}

/// Adds the voxels of a band, grown by a box of one voxel and by `crosses` crosses, to the mask.
void addGrown(const VoxelSet& band, int crosses, int z, MaskPlane& mask)
{
  const auto boxed = [&](std::initializer_list<int> planes) {
    MaskPlane result(band.size());
    for (const int plane : planes)
      band.rasterize(plane, result);
    result.growAlongX(1);
    result.growAlongY(1);
    return result;
  };
  if (band.planeFirst(z - 1) < band.planeFirst(z + 2)) {
    MaskPlane nearest = boxed({z - 1, z, z + 1});
    for (int n = 0; n < crosses; ++n)
      nearest.growCrosswise();
    mask.unite(nearest);
  }
  for (int away = 1; away <= crosses; ++away) {
    if (band.planeCount(z - 1 - away) == 0 && band.planeCount(z + 1 + away) == 0)
      continue;
    MaskPlane farther = boxed({z - 1 - away, z + 1 + away});
    for (int n = 0; n < crosses - away; ++n)
      farther.growCrosswise();
    mask.unite(farther);
  }
}

/// Sets the voxels of plane z that are children of coarse voxels.
void rasterizeChildren(const VoxelSet& coarse, const Refinement& refinement, int z, MaskPlane& mask)
{
  coarse.forRuns(refinement.parent(z, 2), [&](const Run& run, int x, int y) {
    const int first = refinement.firstChild(y, 1);
    for (const int child : {first, first + 1})
      if (child >= 0 && child < mask.rows())
        mask.setRange(refinement.firstChild(x, 0), refinement.firstChild(x + run.count, 0), child);
  });
}

VoxelSet childrenOf(const VoxelSet& coarse, const Refinement& refinement, const GridSize& size, Execution& execution)
{
  return VoxelSet(size, execution, [&](int z, MaskPlane& mask) { rasterizeChildren(coarse, refinement, z, mask); });
}

/// Voxels this close to the border of the bands' grid are never unknowns: their stencils would leave it.
constexpr int rim = 3;

/// Where the interpolation of a coarser level changes sign, as far as that level's unknowns reach.
VoxelSet predictedZeroLevel(const LevelField& coarse, const Lattice& lattice, Execution& execution)
{
  const VoxelSet predicted =
      childrenOf(coarse.unknowns, Refinement(coarse.lattice, lattice), withMargin(lattice.size), execution);
  return crossings(predicted, interpolated(coarse, lattice, predicted, execution), execution);
}

/// The voxels that hold a band: observed ones, and in a tile those at its cuts, where the band continues.
VoxelSet holdOf(const VoxelSet& observed, const BandTile* tile, Execution& execution)
{
  const GridSize size = observed.size();
  return VoxelSet(size, execution, [&](int z, MaskPlane& mask) {
    observed.rasterize(z, mask);
    if (tile && ((z == rim && tile->isCutBelow) || (z == size.z - rim - 1 && tile->isCutAbove)))
      for (int y = 0; y < size.y; ++y)
        mask.setRange(0, size.x, y);
  });
}

/// The band of a level around the zero level as far as that is known, held by observations or not. \param narrow voxels
/// of the coarser level where the band is narrow
VoxelSet bandAround(const VoxelSet& zeroLevel, const VoxelSet& observed, const VoxelSet& narrow, const BandLevel& own,
                    const Refinement& refinement, const VoxelSet& coarseUnknowns, Execution& execution)
{
  const GridSize size = zeroLevel.size();
  const int crosses = own.isFirst && own.isFinest() ? crossesOfOnlyBand : crossesNearData;
  const VoxelSet farZeroLevel(size, execution, [&](int z, MaskPlane& mask) {
    MaskPlane near(size);
    rasterizeChildren(narrow, refinement, z, near);
    zeroLevel.rasterize(z, mask);
    mask.subtract(near);
  });
  const auto fill = [&](int z, MaskPlane& mask) {
    if (z < rim || z >= size.z - rim)
      return;
    addGrown(zeroLevel, crosses, z, mask);
    addGrown(farZeroLevel, crossesFarFromData, z, mask);
    observed.rasterize(z, mask);
    // Interpolated values are known all around these voxels only.
    MaskPlane predicted(size);
    rasterizeChildren(coarseUnknowns, refinement, z, predicted);
    mask.intersect(predicted);
    mask.keepWithin(rim, size.x - rim, size.y - rim);
  };
  return VoxelSet(size, execution, fill, size.x - rim);
}

/// The samples whose cells have all of their voxels in a set.
std::vector<PointSample> samplesWithin(const std::vector<PointSample>& samples, const VoxelSet& voxels)
{
  const auto isWithin = [&](const PointSample& sample) {
    return voxels.containsCell(floorOf(sample.position.x()) + gridMargin, floorOf(sample.position.y()) + gridMargin,
                               floorOf(sample.position.z()) + gridMargin);
  };
  std::vector<PointSample> within;
  within.reserve(std::count_if(samples.begin(), samples.end(), isWithin)); // growing would take up to thrice as much
  std::copy_if(samples.begin(), samples.end(), std::back_inserter(within), isWithin);
  return within;
}

/// The samples of a level, and of its coarser grids, whose cells have all of their voxels among the unknowns.
LevelSamples samplesOf(const BandLevel& own, const VoxelSet& unknowns, std::size_t coarseGrids, Execution& execution)
{
  const LevelSamples& all = *own.observation.samples;
  LevelSamples samples;
  samples.own.resize(all.own.size());
  samples.beneath.resize(all.beneath.size());
  samples.own[own.level] = samplesWithin(all.own[own.level], unknowns);
  VoxelSet voxels = unknowns;
  for (std::size_t at = own.level; at > 0 && own.level - at < coarseGrids; --at) {
    const Refinement refinement(own.lattices[at - 1], own.lattices[at]);
    voxels = coarsened(voxels, withMargin(own.lattices[at - 1].size), refinement, execution);
    samples.beneath[at - 1] = samplesWithin(all.beneath[at - 1], voxels);
  }
  return samples;
}

/// Continues the change of a field from the unknowns to the rest of its support: along x, then y, then z, each from the
/// closest voxel with a change.
class ChangeOfField {
public:
  /// \param guess values of the unknowns before the change
  ChangeOfField(const VoxelSet& unknowns, const VoxelSet& support, const PackedValues& guess,
                const PackedValues& values, Execution& execution)
      : unknowns_(unknowns), support_(support), guess_(guess), values_(values), execution_(execution),
        change_(values.size()), isKnown_(values.size())
  {
    extendAlongRows();
    extendAcrossRows(1);
    extendAcrossRows(2);
  }

  /// Adds the change to the values around the unknowns. \param values those that the constructor was given
  void addAround(PackedValues& values)
  {
    forEach<int>(execution_, support_.size().z, grainPlanes, [&](int z) {
      forEachPair(unknowns_, support_, z, [&](std::int64_t, std::int64_t own, std::int64_t count) {
        std::fill_n(change_.begin() + own, count, 0.f);
      });
      for (std::int64_t at = support_.planeFirst(z); at < support_.planeFirst(z + 1); ++at)
        values[at] += change_[at];
    });
  }

private:
  static constexpr std::int64_t grainPlanes = 4;

  /// Calls body(y, z, run, index of its first value) for all runs of the support.
  template <typename Body>
  void forRuns(const Body& body) const
  {
    forEach<int>(execution_, support_.size().z, grainPlanes, [&](int z) {
      support_.forRuns(z, [&](const Run& run, int, int y) { body(y, z, run, support_.planeFirst(z) + run.first); });
    });
  }

  void extendAlongRows()
  {
    forRuns([&](int y, int z, const Run& run, std::int64_t first) {
      float* const changes = change_.data() + first;
      int known = -1; // the last voxel of the run with a change of its own
      for (const Run& inner : unknowns_.row(y, z)) {
        const int begin = inner.at - run.at;
        if (begin < 0 || begin >= run.count)
          continue;
        const float* const before = guess_.data() + unknowns_.planeFirst(z) + inner.first;
        for (int i = 0; i < inner.count; ++i)
          changes[begin + i] = values_[first + begin + i] - before[i];
        for (int i = known + 1; i < begin; ++i)
          changes[i] = known >= 0 && i - known <= begin - i ? changes[known] : changes[begin];
        known = begin + inner.count - 1;
      }
      std::fill(changes + known + 1, changes + run.count, known >= 0 ? changes[known] : 0);
      std::fill_n(isKnown_.data() + first, run.count, known >= 0 ? 1 : 0);
    });
  }

  /// \param axis 1: y, 2: z
  void extendAcrossRows(int axis)
  {
    const PackedFlags before = isKnown_;
    forRuns([&](int y, int z, const Run& run, std::int64_t first) {
      const int x = support_.xOf(run, y);
      for (int i = 0; i < run.count; ++i) {
        const std::int64_t at = first + i;
        for (int step = 1; isKnown_[at] == 0 && step <= interpolationReach; ++step)
          for (const int side : {-step, step}) {
            const std::int64_t from = support_.find(x + i, y + (axis == 1 ? side : 0), z + (axis == 2 ? side : 0));
            if (from >= 0 && before[from]) {
              change_[at] = change_[from];
              isKnown_[at] = 1;
              break;
            }
          }
      }
    });
  }

  const VoxelSet& unknowns_;
  const VoxelSet& support_;
  const PackedValues& guess_;
  const PackedValues& values_;
  Execution& execution_;
  PackedValues change_;
  PackedFlags isKnown_;
};

/// Sets the unknowns of a field to solved(interpolated value, index among them, index in the support), but none farther
/// than farthestMove from the interpolation of the coarser field, and continues the change to the support around them.
/// \pre the support around the unknowns has the interpolation
template <typename Solved>
void changeField(LevelField& field, const LevelField& coarse, const Solved& solved, Execution& execution)
{
  const PackedValues guess = interpolated(coarse, field.lattice, field.unknowns, execution);
  const float most = farthestMove * static_cast<float>(field.lattice.spacing);
  for (int z = 0; z < field.unknowns.size().z; ++z)
    forEachPair(field.unknowns, field.support, z, [&](std::int64_t inner, std::int64_t outer, std::int64_t count) {
      for (std::int64_t i = 0; i < count; ++i) {
        const float former = guess[inner + i];
        field.values[outer + i] = std::clamp(solved(former, inner + i, outer + i), former - most, former + most);
      }
    });
  ChangeOfField(field.unknowns, field.support, guess, field.values, execution).addAround(field.values);
}

} // namespace

bool RimCounts::missSheet() const
{
  // Trees and posts before a lidar make one voxel in 400 to 4,000 touch the rim. Solving a street's bands again for
  // them takes two fifths of the time of the levels; without it, points of the street and of four simulated scans are
  // -.8 to 1.6 % farther from the mesh. More voxels touch the rim where a plate is little thicker than its noise.
  constexpr std::int64_t mayTouch = 500;
  return touching * mayTouch > zeroLevel;
}

VoxelSet zeroLevelAtData(const LevelField& field, int begin, int end, Execution& execution)
{
  return VoxelSet::inPieces(field.support.size(), execution, [&]() -> VoxelSet::Fill {
    CrossingFinder finder(field.support, field.values.data());
    return [&field, begin, end, finder](int z, MaskPlane& mask) mutable {
      if (z < begin || z >= end)
        return;
      finder(z, mask);
      MaskPlane close(field.support.size());
      for (const int plane : {z - 1, z, z + 1})
        field.observed.rasterize(plane, close);
      close.growAlongX(1);
      close.growAlongY(1);
      mask.intersect(close);
    };
  });
}

RimCounts rimCounts(const VoxelSet& unknowns, const VoxelSet& zeroLevel, Execution& execution)
{
  const GridSize size = unknowns.size();
  const VoxelSet inside = eroded(unknowns, 1, execution);
  const VoxelSet touching(size, execution, [&](int z, MaskPlane& mask) {
    if (z < rim || z >= size.z - rim)
      return;
    MaskPlane solved(size), inner(size);
    unknowns.rasterize(z, mask);
    inside.rasterize(z, inner);
    zeroLevel.rasterize(z, solved);
    mask.subtract(inner);
    mask.intersect(solved);
    mask.keepWithin(rim, size.x - rim, size.y - rim);
  });
  return {zeroLevel.count(), touching.count()};
}

VoxelSet united(const VoxelSet& a, const VoxelSet& b, Execution& execution)
{
  return combined(a, b, &MaskPlane::unite, execution);
}

VoxelSet voxelSetOf(const std::vector<std::int64_t>& voxels, const GridSize& lattice, const GridSize& grid,
                    Execution& execution)
{
  return VoxelSet(grid, execution, [&](int z, MaskPlane& mask) {
    const int k = z - gridMargin;
    if (k < 0 || k >= lattice.z)
      return;
    const auto begin = std::lower_bound(voxels.begin(), voxels.end(), lattice.planeCount() * k);
    const auto end = std::lower_bound(begin, voxels.end(), lattice.planeCount() * (k + 1));
    for (auto voxel = begin; voxel != end; ++voxel) {
      const auto inPlane = static_cast<int>(*voxel % lattice.planeCount());
      mask.set(inPlane % lattice.x + gridMargin, inPlane / lattice.x + gridMargin);
    }
  });
}

LevelField fieldOfDense(const Lattice& lattice, const std::vector<float>& values, VoxelSet observed,
                        Execution& execution)
{
  LevelField field;
  field.lattice = lattice;
  field.observed = std::move(observed);
  const GridSize inner = lattice.size, size = withMargin(inner);
  field.support = VoxelSet(size, execution, [&](int, MaskPlane& mask) {
    for (int y = 0; y < size.y; ++y)
      mask.setRange(0, size.x, y);
  });
  field.values.reserve(size.count());
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x)
        field.values.push_back(
            values[inner.index(std::clamp(x - gridMargin, 0, inner.x - 1), std::clamp(y - gridMargin, 0, inner.y - 1),
                               std::clamp(z - gridMargin, 0, inner.z - 1))]);
  const VoxelSet zeroLevel = crossings(field.support, field.values, execution);
  field.unknowns = VoxelSet(size, execution, [&](int z, MaskPlane& mask) {
    addGrown(zeroLevel, crossesOfDense, z, mask);
    field.observed.rasterize(z, mask);
  });
  return field;
}

void keepNear(const VoxelSet& surface, LevelField& field, Execution& execution)
{
  const VoxelSet near = dilated(united(surface, field.observed, execution), nearWanted, nearWanted, execution);
  field.unknowns = common(field.unknowns, near, execution);
}

void keepNear(const VoxelSet& surface, BandedDistances& field, Execution& execution)
{
  VoxelSet kept = common(field.band, dilated(surface, aroundLeft, aroundLeft, execution), execution);
  field.values = valuesOn(kept, field.band, field.values);
  field.band = std::move(kept);
}

std::shared_ptr<BandedDistances> leaveFarFrom(const VoxelSet& wanted, LevelField& field, Execution& execution)
{
  VoxelSet near = common(field.unknowns, dilated(wanted, aroundDense, aroundDense, execution), execution);
  const VoxelSet left = without(field.unknowns, near, execution);
  if (static_cast<double>(left.count()) <= worthLeaving * static_cast<double>(field.unknowns.count()))
    return nullptr;
  field.unknowns = std::move(near);
  const VoxelSet surface = common(left, crossings(field.support, field.values, execution), execution);
  auto kept = std::make_shared<BandedDistances>();
  kept->band = common(field.support, dilated(surface, aroundLeft, aroundLeft, execution), execution);
  kept->values = valuesOn(kept->band, field.support, field.values);
  field.left = left;
  return kept;
}

PackedValues interpolated(const LevelField& coarse, const Lattice& lattice, const VoxelSet& fine, Execution& execution)
{
  const Refinement refinement(coarse.lattice, lattice);
  PackedValues values(fine.count());
  execution.forRange(fine.size().z, 16, [&](int begin, int end) {
    TransferScratch scratch;
    for (int z = begin; z < end; ++z)
      interpolatePlane({coarse.support, coarse.values.data()}, refinement, fine, z, values.data() + fine.planeFirst(z),
                       scratch);
  });
  return values;
}

LevelField fieldOfChange(const LevelField& coarse, const Lattice& lattice, VoxelSet unknowns,
                         const PackedValues& change, int reach, Execution& execution)
{
  LevelField field;
  field.lattice = lattice;
  field.support = dilated(unknowns, reach, reach, execution);
  field.values = interpolated(coarse, lattice, field.support, execution);
  field.unknowns = std::move(unknowns);
  changeField(
      field, coarse, [&](float former, std::int64_t inner, std::int64_t) { return former + change[inner]; }, execution);
  return field;
}

LevelField solveNarrowBand(const BandLevel& own, const LevelField& coarse, const LevelPlan& plan,
                           const SolverOptions& solver, LevelReport& report, Execution& execution)
{
  const LevelObservation& observation = own.observation;
  const Lattice& lattice = own.lattices[own.level];
  const GridSize size = withMargin(lattice.size);
  const Refinement refinement(coarse.lattice, lattice);
  LevelField field;
  field.lattice = lattice;
  field.observed = observation.samples ? observedVoxels(observation.samples->own[own.level], size, execution)
                                       : voxelSetOf(observation.voxels.voxels, lattice.size, size, execution);
  report.observed = field.observed.count();
  const bool isPartial = coarse.left.count() > 0;
  VoxelSet beyond; // what the coarser level left out, and its seam: sheets continue there
  if (isPartial) {
    beyond = childrenOf(dilated(coarse.left, aroundLeft, aroundLeft, execution), refinement, size, execution);
    field.observed = without(field.observed, beyond, execution);
  }

  VoxelSet zeroLevel = predictedZeroLevel(coarse, lattice, execution);
  if (own.tile && own.tile->found.count() > 0)
    zeroLevel = united(zeroLevel, own.tile->found, execution);
  const VoxelSet narrow = own.isFinest() ? coarse.unknowns : dilated(coarse.observed, nearData, nearData, execution);
  const int reach = own.isFinest() ? order(own.prior) : interpolationReach;
  const int reachX = own.isFinest() ? order(own.prior) : interpolationReachX;
  for (int round = 0; round < maxBandRounds; ++round) {
    VoxelSet band = bandAround(zeroLevel, field.observed, narrow, own, refinement, coarse.unknowns, execution);
    // Without what is connected to the seam, a sheet that has no points in the band would end there.
    const VoxelSet held = isPartial ? connectedTo(band, beyond, execution) : VoxelSet();
    const auto withHeld = [&](VoxelSet solved) {
      return isPartial ? united(solved, held, execution) : std::move(solved);
    };
    // What no observation holds would float: it is no unknown. What only the seam holds stays as interpolated.
    VoxelSet unknowns = connectedTo(std::move(band),
                                    own.tile ? holdOf(field.observed, own.tile, execution) : field.observed, execution);
    field.support = isPartial ? dilated(united(unknowns, held, execution), reach, reachX, execution)
                              : dilated(unknowns, reach, reachX, execution);
    field.values = interpolated(coarse, lattice, field.support, execution);
    if (unknowns.count() == 0) { // in an empty tile, or where all is left to coarser levels
      report.unknowns = 0;
      report.solve.converged = true;
      field.unknowns = withHeld(std::move(unknowns));
      return field;
    }
    LevelSamples samplesInside; // the grids refer to them
    LevelObservation observed = observation;
    if (isPartial) {
      samplesInside = samplesOf(own, unknowns, plan.coarseGrids, execution);
      observed.samples = &samplesInside;
    }
    std::vector<SolverGrid> grids =
        bandGrids(own.lattices, own.level, std::move(unknowns), observed, own.prior, plan.coarseGrids, execution);
    report.unknowns = grids[0].voxels.count();
    // Every round starts from the interpolation: it is smooth beyond the band, and the continued solution is not.
    const GridSystem system{grids, own.prior, field.support, nullptr, own.tile ? &own.tile->step : nullptr};
    const SolveReport solve = solveOnGrids(system, plan, solver, lattice.spacing, field.values.data(), execution);
    const int before = report.solve.iterations;
    report.solve = solve;
    report.solve.iterations += before;
    field.unknowns = withHeld(std::move(grids[0].voxels));
    if (own.tile)
      return field;
    // The guess is computed again: kept while the level is solved, it would add to the peak of memory.
    changeField(
        field, coarse, [&](float, std::int64_t, std::int64_t outer) { return field.values[outer]; }, execution);
    if (round + 1 == maxBandRounds)
      break;
    const VoxelSet solved = zeroLevelAtData(field, 0, size.z, execution);
    if (!rimCounts(field.unknowns, solved, execution).missSheet())
      break;
    zeroLevel = united(zeroLevel, solved, execution);
  }
  return field;
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "field/voxel_set.h"

#include "base/disjoint_sets.h"
#include "base/loops.h"
#include "base/multiversioning.h"
#include "base/text.h"

#include <pcl/surface/mrf/exceptions.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

namespace pcl::mrf {
namespace {

/// Runs are lengthened to multiples of this many voxels, which one vector holds. (Half as many save 3 % of the memory
/// and no time, and make the holes of two in three scans 1 to 6 % worse.)
constexpr int runUnit = 8;

/// Max number of rows, and of runs: both have 32-bit indices.
constexpr std::uint32_t maxNumbers = std::numeric_limits<std::uint32_t>::max();

/// Planes per piece of parallel work.
constexpr int grainPlanes = 8;

/// Planes per piece of work that has to read planes of the neighboring pieces first.
constexpr int windowPlanes = 32;

/// Calls body(begin, end) for the maximal ranges of set bits.
template <typename Body>
void forEachRange(const std::uint64_t* words, int count, const Body& body)
{
  const int bits = count * MaskPlane::wordBits;
  const auto next = [&](int from, std::uint64_t flip) {
    int word = from / MaskPlane::wordBits;
    if (word >= count)
      return bits;
    std::uint64_t value = (words[word] ^ flip) & (~std::uint64_t{0} << (from % MaskPlane::wordBits));
    while (value == 0 && ++word < count)
      value = words[word] ^ flip;
    return word < count ? word * MaskPlane::wordBits + __builtin_ctzll(value) : bits;
  };
  for (int begin = next(0, 0); begin < bits;) {
    const int end = next(begin, ~std::uint64_t{0});
    body(begin, end);
    begin = next(end, 0);
  }
}

/// Calls grow(shift), which unites a mask with itself shifted, until it has grown by `steps` to both sides. A voxel at
/// the border that has grown by n is a range of n + 1 voxels, so that a shift of n + 1 leaves no gap.
template <typename Grow>
void growInStrides(int steps, const Grow& grow)
{
  for (int grown = 0; grown < steps;) {
    const int shift = std::min({grown + 1, steps - grown, MaskPlane::wordBits - 1});
    grow(shift);
    grown += shift;
  }
}

/// True if the runs of two planes are the same.
bool haveSameRuns(const Runs& a, const Runs& b)
{
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Run& run, const Run& other) { return run.at == other.at && run.count == other.count; });
}

} // namespace

void requireCountable(const GridSize& size)
{
  const double window = static_cast<double>(windowStrideOf(size)) * (size.y + 2.),
               rows = static_cast<double>(size.y) * size.z;
  const double excess = std::max(window / std::numeric_limits<std::int32_t>::max(), rows / maxNumbers);
  if (excess > 1)
    throw ResourceLimit(textOf(2, "a grid of ", size.x, " x ", size.y, " x ", size.z,
                               " voxels has planes or rows that 32-bit numbers cannot count; choose voxels ",
                               1.01 * std::sqrt(excess), " times as large"));
}

MaskPlane::MaskPlane(const MaskPlane& other) : MaskPlane(other.size_)
{
  unite(other);
}

std::uint64_t* MaskPlane::row(int y)
{
  std::uint64_t* const words = bits_.data() + std::ptrdiff_t{words_} * y;
  if (!isUsed(y))
    std::fill_n(words, words_, std::uint64_t{0});
  isUsed_[y] = 1;
  return words;
}

void MaskPlane::setRange(int begin, int end, int y)
{
  begin = std::max(begin, 0);
  end = std::min(end, size_.x);
  if (begin < end)
    setBits(row(y), begin, end);
}

void MaskPlane::keepWithin(int begin, int endX, int endY)
{
  std::vector<std::uint64_t> inside(words_, 0);
  setBits(inside.data(), begin, std::max(begin, std::min(endX, size_.x)));
  for (int y = 0; y < size_.y; ++y)
    if (y < begin || y >= endY)
      isUsed_[y] = 0;
    else if (isUsed(y))
      std::transform(row(y), row(y) + words_, inside.begin(), row(y), std::bit_and<>());
}

bool MaskPlane::empty() const
{
  for (int y = 0; y < size_.y; ++y)
    if (isUsed(y) && std::any_of(row(y), row(y) + words_, [](std::uint64_t word) { return word != 0; }))
      return false;
  return true;
}

void MaskPlane::unite(const MaskPlane& other)
{
  for (int y = 0; y < size_.y; ++y)
    if (other.isUsed(y))
      std::transform(row(y), row(y) + words_, other.row(y), row(y), std::bit_or<>());
}

void MaskPlane::intersect(const MaskPlane& other)
{
  for (int y = 0; y < size_.y; ++y)
    if (isUsed(y) && other.isUsed(y))
      std::transform(row(y), row(y) + words_, other.row(y), row(y), std::bit_and<>());
    else
      isUsed_[y] = 0;
}

void MaskPlane::subtract(const MaskPlane& other)
{
  for (int y = 0; y < size_.y; ++y)
    if (isUsed(y) && other.isUsed(y))
      std::transform(row(y), row(y) + words_, other.row(y), row(y),
                     [](std::uint64_t own, std::uint64_t others) { return own & ~others; });
}

std::uint64_t MaskPlane::lastWord() const
{
  const int rest = size_.x % wordBits;
  return rest == 0 ? ~std::uint64_t{0} : ~std::uint64_t{0} >> (wordBits - rest);
}

void MaskPlane::growAlongX(int steps)
{
  for (int y = 0; y < size_.y; ++y) {
    if (!isUsed(y))
      continue;
    std::uint64_t* const words = row(y);
    growInStrides(steps, [&](int shift) {
      std::uint64_t before = 0;
      for (int w = 0; w < words_; ++w) {
        const std::uint64_t own = words[w], after = w + 1 < words_ ? words[w + 1] : 0;
        words[w] = own | own << shift | own >> shift | before >> (wordBits - shift) | after << (wordBits - shift);
        before = own;
      }
      words[words_ - 1] &= lastWord();
    });
  }
}

void MaskPlane::growAlongY(int steps)
{
  growInStrides(steps, [&](int shift) {
    const MaskPlane before = *this;
    for (int y = 0; y < size_.y; ++y)
      for (const int other : {y - shift, y + shift})
        if (before.mayHave(other))
          std::transform(row(y), row(y) + words_, before.row(other), row(y), std::bit_or<>());
  });
}

void MaskPlane::growUpwards()
{
  for (int y = size_.y - 1; y >= 0; --y) {
    if (!isUsed(y) && !mayHave(y - 1))
      continue;
    std::uint64_t* const words = row(y);
    const std::uint64_t* const lower = mayHave(y - 1) ? row(y - 1) : none_.data();
    std::uint64_t before = 0;
    for (int w = 0; w < words_; ++w) {
      const std::uint64_t both = words[w] | lower[w];
      words[w] = both | both << 1 | before >> (wordBits - 1);
      before = both;
    }
    words[words_ - 1] &= lastWord();
  }
}

void MaskPlane::growCrosswise()
{
  MaskPlane alongY = *this;
  alongY.growAlongY(1);
  growAlongX(1);
  unite(alongY);
}

void MaskPlane::shrinkCrosswise()
{
  const MaskPlane before = *this;
  clear();
  for (int y = 1; y + 1 < size_.y; ++y) {
    if (!before.isUsed(y - 1) || !before.isUsed(y) || !before.isUsed(y + 1))
      continue;
    std::uint64_t* const words = row(y);
    const std::uint64_t *const own = before.row(y), *const lower = before.row(y - 1), *const upper = before.row(y + 1);
    for (int w = 0; w < words_; ++w) {
      const std::uint64_t left = own[w] << 1 | (w > 0 ? own[w - 1] >> (wordBits - 1) : 0);
      words[w] = own[w] & left & nextBits(own, w, words_) & lower[w] & upper[w];
    }
  }
}

VoxelSet::VoxelSet(GridSize size, Execution& execution, const Fill& fill, int roundUpTo)
{
  build(
      size, [&] { return fill; }, roundUpTo, grainPlanes, execution);
}

VoxelSet VoxelSet::inPieces(GridSize size, Execution& execution, const std::function<Fill()>& makeFill)
{
  VoxelSet band;
  band.build(size, makeFill, 0, windowPlanes, execution);
  return band;
}

/// Adds the runs of a row. \param values the number of voxels in the plane's rows before it \return the same with it
std::int64_t VoxelSet::addRow(const MaskPlane& mask, int y, int roundUpTo, std::int64_t values,
                              std::vector<Run>& runs) const
{
  if (!mask.isUsed(y))
    return values;
  const std::size_t before = runs.size();
  int done = 0; // the voxels of this row before it are in a run already
  forEachRange(mask.row(y), mask.words(), [&](int from, int to) {
    if (to <= done)
      return;
    const bool joins = runs.size() > before && from <= done;
    from = joins ? done : from;
    if (roundUpTo > 0) {
      const int first = joins ? runs.back().count + from - done : 0; // voxels of the run that is continued
      const int rest = (first + to - from) % runUnit;
      if (rest != 0)
        to = std::max(to, std::min(to + runUnit - rest, roundUpTo));
    }
    if (joins)
      runs.back().count += to - from;
    else
      runs.push_back({windowIndex(from, y), to - from, static_cast<std::uint32_t>(values)});
    values += to - from;
    done = to;
  });
  return values;
}

void VoxelSet::build(GridSize size, const std::function<Fill()>& makeFill, int roundUpTo, int pieceSize,
                     Execution& execution)
{
  size_ = size;
  requireCountable(size);
  std::vector<std::vector<Run>> planes(size.z);
  rowBegin_.assign(std::int64_t{size.y} * size.z + 1, 0);
  planeFirst_.assign(size.z + 1, 0);
  execution.forRange(size.z, pieceSize, [&](int begin, int end) {
    MaskPlane mask(size);
    const Fill fill = makeFill();
    for (int z = begin; z < end; ++z) {
      mask.clear();
      fill(z, mask);
      std::vector<Run>& runs = planes[z];
      std::int64_t values = 0;
      for (int y = 0; y < size.y; ++y) {
        const std::size_t before = runs.size();
        values = addRow(mask, y, roundUpTo, values, runs);
        rowBegin_[y + std::int64_t{size.y} * z + 1] = static_cast<std::uint32_t>(runs.size() - before);
      }
      planeFirst_[z + 1] = values;
    }
  });

  std::size_t total = 0;
  for (std::size_t z = 0; z < planes.size(); ++z) {
    total += planes[z].size();
    largestPlane_ = std::max(largestPlane_, planeFirst_[z + 1]);
    planeFirst_[z + 1] += planeFirst_[z];
  }
  if (total > maxNumbers)
    throw ResourceLimit("a band of " + std::to_string(planeFirst_.back()) + " voxels has " + std::to_string(total) +
                        " runs, more than 32-bit numbers count; choose a larger voxel size");
  runs_ = joined(std::move(planes));
  std::partial_sum(rowBegin_.begin(), rowBegin_.end(), rowBegin_.begin());
  for (bottom_ = 0; bottom_ < size.z && planeCount(bottom_) == 0;)
    ++bottom_;
  for (top_ = size.z; top_ > bottom_ && planeCount(top_ - 1) == 0;)
    --top_;
  likeFirst_.resize(size.z);
  for (int z = 0; z < size.z; ++z)
    likeFirst_[z] = z > 0 && haveSameRuns(plane(z - 1), plane(z)) ? likeFirst_[z - 1] : z;
}

void VoxelSet::rasterize(int z, MaskPlane& mask) const
{
  forRuns(z, [&](const Run& run, int x, int y) { setBits(mask.row(y), x, x + run.count); });
}

std::size_t VoxelSet::bytes() const
{
  return runs_.capacity() * sizeof(Run) + rowBegin_.capacity() * sizeof(std::uint32_t) +
         planeFirst_.capacity() * sizeof(std::int64_t) + likeFirst_.capacity() * sizeof(std::int32_t);
}

VoxelSet dilated(const VoxelSet& band, int steps, int stepsX, Execution& execution)
{
  return VoxelSet(band.size(), execution, [&](int z, MaskPlane& mask) {
    for (int other = z - steps; other <= z + steps; ++other)
      band.rasterize(other, mask);
    mask.growAlongY(steps);
    mask.growAlongX(stepsX);
  });
}

VoxelSet eroded(const VoxelSet& band, int steps, Execution& execution)
{
  const VoxelSet shrunk(band.size(), execution, [&](int z, MaskPlane& mask) {
    band.rasterize(z, mask);
    mask.shrinkCrosswise();
    for (const int other : {z - 1, z + 1}) {
      MaskPlane beside(band.size());
      band.rasterize(other, beside);
      mask.intersect(beside);
    }
  });
  return steps > 1 ? eroded(shrunk, steps - 1, execution) : shrunk;
}

PackedValues degrees(const VoxelSet& band, Execution& execution)
{
  PackedValues result(band.count());
  execution.forRange(band.size().z, windowPlanes, [&](int first, int last) {
    if (band.planeFirst(first) == band.planeFirst(last))
      return;
    // Windows of planes by z modulo 3; they are 1 at the voxels of the band.
    ZeroedFloats windows(3 * band.windowCount());
    const auto window = [&](int z) { return windows.data() + (z + 3) % 3 * band.windowCount(); };
    for (int z = first - 1; z <= last; ++z) {
      if (z - 3 >= first - 1)
        kernels::fill(band.plane(z - 3), 0, window(z - 3));
      kernels::fill(band.plane(z), 1, window(z));
      if (z > first)
        kernels::sumNeighbors(band.plane(z - 1), {band.windowStride(), window(z - 2), window(z - 1), window(z)},
                              result.data() + band.planeFirst(z - 1));
    }
  });
  return result;
}

VoxelSet connectedTo(VoxelSet band, const VoxelSet& other, Execution& execution)
{
  const GridSize size = band.size();
  const auto indexOf = [&](const Run* run) { return static_cast<std::uint32_t>(run - band.row(0, 0).begins); };
  const std::size_t runs = indexOf(band.row(size.y - 1, size.z - 1).ends);
  DisjointSets parts(runs);
  const auto forRows = [&](const auto& body) {
    forEach<int>(execution, size.z, windowPlanes, [&](int z) {
      for (int y = 0; y < size.y; ++y)
        body(y, z);
    });
  };
  const auto forOverlaps = [&](const Runs& a, const Runs& b, const auto& body) {
    const Run* first = b.begins;
    for (const Run& run : a) {
      // Rows differ by a multiple of the stride in their window indices: compare positions along x.
      const int begin = run.at - a.origin, end = begin + run.count;
      while (first != b.ends && first->at - b.origin + first->count <= begin)
        ++first;
      for (const Run* match = first; match != b.ends && match->at - b.origin < end; ++match)
        body(&run, match);
    }
  };
  forRows([&](int y, int z) {
    const auto unite = [&](const Run* a, const Run* b) { parts.join(indexOf(a), indexOf(b)); };
    if (y > 0)
      forOverlaps(band.row(y, z), band.row(y - 1, z), unite);
    if (z > 0)
      forOverlaps(band.row(y, z), band.row(y, z - 1), unite);
  });
  std::vector<std::atomic<bool>> isReached(runs); // at the first run of each part
  forRows([&](int y, int z) {
    forOverlaps(band.row(y, z), other.row(y, z), [&](const Run* own, const Run*) {
      isReached[parts.find(indexOf(own))].store(true, std::memory_order_relaxed);
    });
  });
  std::atomic<bool> keepsAll{true};
  forRows([&](int y, int z) {
    for (const Run& run : band.row(y, z))
      if (!isReached[parts.find(indexOf(&run))])
        keepsAll = false;
  });
  if (keepsAll)
    return band;
  return VoxelSet(size, execution, [&](int z, MaskPlane& mask) {
    band.forRuns(z, [&](const Run& run, int x, int y) {
      if (isReached[parts.find(indexOf(&run))])
        mask.setRange(x, x + run.count, y);
    });
  });
}

namespace kernels {
namespace {

/// Calls body(window index, packed index) for the voxels of a run from the i-th on, in whole vectors of `unit` voxels.
/// \return index of the first voxel that is left
template <int unit, typename Body>
MRF_ALWAYS_INLINE std::int64_t forVectors(const Run& run, std::int64_t i, const Body& body)
{
  const std::int64_t at = run.at, first = run.first, count = run.count;
  for (; i + unit <= count; i += unit)
    for (int lane = 0; lane < unit; ++lane)
      body(at + i + lane, first + i + lane);
  return i;
}

/// Calls body(window index, packed index) for all voxels of the runs, in the widest vectors that they still fill.
template <typename Body>
MRF_ALWAYS_INLINE void forEachVoxel(Runs runs, const Body& body)
{
  for (const Run* run = runs.begins; run != runs.ends; ++run) {
    std::int64_t i = forVectors<vectorUnit>(*run, 0, body);
    i = forVectors<vectorUnit / 2>(*run, i, body);
    i = forVectors<vectorUnit / 4>(*run, i, body);
    forVectors<1>(*run, i, body);
  }
}

MRF_ALWAYS_INLINE float sumOfNeighbors(std::int64_t i, const Planes& p)
{
  const float* const center = p.center;
  return (center[i - 1] + center[i + 1]) + (center[i - p.stride] + center[i + p.stride]) + (p.below[i] + p.above[i]);
}

/// \param z, x step.z and step.x, as restricted pointers, so that the compiler knows that they do not overlap
MRF_ALWAYS_INLINE void advance(const ChebyshevStep& step, float* __restrict z, float* __restrict x, std::int64_t i,
                               std::int64_t v, float product)
{
  const float change = step.f * z[v] + step.g * step.inverseD[v] * (step.b[v] - product);
  z[v] = change;
  x[i] += change;
}

} // namespace

MRF_MULTIVERSION(void, fill, (Runs runs, float value, float* window), (runs, value, window))
{
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t) { window[i] = value; });
}

MRF_MULTIVERSION(void, load, (Runs runs, const float* packed, float* __restrict window), (runs, packed, window))
{
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) { window[i] = packed[v]; });
}

MRF_MULTIVERSION(void, store, (Runs runs, const float* window, float* __restrict packed), (runs, window, packed))
{
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) { packed[v] = window[i]; });
}

MRF_MULTIVERSION(void, addToWindow, (Runs runs, float a, const float* packed, float* __restrict window),
                 (runs, a, packed, window))
{
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) { window[i] += a * packed[v]; });
}

MRF_MULTIVERSION(void, scaleAndAdd, (Runs runs, const float* a, const float* packed, float* __restrict window),
                 (runs, a, packed, window))
{
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) { window[i] = a[v] * window[i] + packed[v]; });
}

MRF_MULTIVERSION(void, sumNeighbors, (Runs runs, Planes planes, float* __restrict packed), (runs, planes, packed))
{
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) { packed[v] = sumOfNeighbors(i, planes); });
}

MRF_MULTIVERSION(void, laplacian, (Runs runs, const float* degrees, Planes planes, float* __restrict out),
                 (runs, degrees, planes, out))
{
  if (degrees)
    forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) {
      out[i] = degrees[v] * planes.center[i] - sumOfNeighbors(i, planes);
    });
  else
    forEachVoxel(runs,
                 [=](std::int64_t i, std::int64_t) { out[i] = 6 * planes.center[i] - sumOfNeighbors(i, planes); });
}

MRF_MULTIVERSION(void, addLaplacian, (Runs runs, const float* degrees, Planes planes, float* __restrict out),
                 (runs, degrees, planes, out))
{
  if (degrees)
    forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) {
      out[i] += degrees[v] * planes.center[i] - sumOfNeighbors(i, planes);
    });
  else
    forEachVoxel(runs,
                 [=](std::int64_t i, std::int64_t) { out[i] += 6 * planes.center[i] - sumOfNeighbors(i, planes); });
}

MRF_MULTIVERSION(void, addWindow, (Runs runs, float a, const float* x, float* __restrict out), (runs, a, x, out))
{
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t) { out[i] += a * x[i]; });
}

MRF_MULTIVERSION(void, startChebyshev,
                 (Runs runs, float g, const float* b, const float* inverseD, float* __restrict z, float* __restrict x),
                 (runs, g, b, inverseD, z, x))
{
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) { x[i] = z[v] = g * inverseD[v] * b[v]; });
}

MRF_MULTIVERSION(void, stepChebyshev, (Runs runs, ChebyshevStep step, const float* product), (runs, step, product))
{
  float* const __restrict z = step.z, * const __restrict x = step.x;
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) { advance(step, z, x, i, v, product[i]); });
}

MRF_MULTIVERSION(void, stepChebyshevWithLaplacian,
                 (Runs runs, ChebyshevStep step, const float* product, const float* degrees, Planes planes,
                  float tension, const float* tense),
                 (runs, step, product, degrees, planes, tension, tense))
{
  float* const __restrict z = step.z, * const __restrict x = step.x;
  // Not inlined, as happens for the few voxels at the end of a run, these would be compiled for the baseline.
  const auto whole = [=](std::int64_t i, std::int64_t v) MRF_ALWAYS_INLINED {
    return product[i] + (degrees[v] * planes.center[i] - sumOfNeighbors(i, planes));
  };
  const auto relaxed = [=](std::int64_t i, std::int64_t v)
                           MRF_ALWAYS_INLINED { advance(step, z, x, i, v, whole(i, v)); };
  if (tense)
    forEachVoxel(runs,
                 [=](std::int64_t i, std::int64_t v) { advance(step, z, x, i, v, whole(i, v) + tension * tense[i]); });
  else
    forEachVoxel(runs, relaxed);
}

MRF_MULTIVERSION(void, residual, (Runs runs, const float* product, const float* b, float* r), (runs, product, b, r))
{
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) { r[v] = b[v] - product[i]; });
}

MRF_MULTIVERSION(void, addWeighted, (Runs runs, const float* w, const float* x, float* __restrict product),
                 (runs, w, x, product))
{
  forEachVoxel(runs, [=](std::int64_t i, std::int64_t v) { product[i] += w[v] * x[i]; });
}

} // namespace kernels
} // namespace pcl::mrf

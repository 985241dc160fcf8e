// SPDX-License-Identifier: BSD-3-Clause
/// Sparse sets of voxels around a surface: runs of voxels along x, stored by rows and planes.
///
/// A field in a band has one value per voxel of the runs, plane after plane, in a plain array ("packed"). Stencils work
/// on windows: dense planes that are zero outside the runs. Only the few windows that a sweep works on exist at a time.
/// So a Laplacian needs no neighbor table, and memory grows with the surface.
#pragma once

#include "base/arrays.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/lattice.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace pcl::mrf {

/// Voxels of the widest vectors, which fill a cache line. A row of a window is a whole number of vectors.
constexpr int vectorUnit = 16;

/// Voxels before voxel 0 in each row of a window. With gridMargin they make a vector, so that the rows of a whole level
/// begin with a vector.
constexpr int windowMargin = 12;

/// Voxels from row to row of the windows of a grid.
inline std::int64_t windowStrideOf(const GridSize& size)
{
  return (std::int64_t{size.x} + windowMargin + vectorUnit - 1) / vectorUnit * vectorUnit;
}

/// \throw ResourceLimit if 32-bit numbers cannot count the voxels of a window plane of this grid, or its rows
void requireCountable(const GridSize& size);

/// Bits of one plane of voxels, 64 along x per word. What is done costs by the rows that were written to: of a wide
/// plane most are empty.
class MaskPlane {
public:
  static constexpr int wordBits = 64;

  MaskPlane() = default;
  explicit MaskPlane(GridSize size)
      : size_(size), words_((size.x + wordBits - 1) / wordBits), none_(words_, 0), isUsed_(size.y, 0),
        bits_(std::int64_t{words_} * size.y)
  {}
  MaskPlane(const MaskPlane& other);
  MaskPlane(MaskPlane&&) = default;
  MaskPlane& operator=(MaskPlane&&) = default;

  int words() const { return words_; }
  int rows() const { return size_.y; }
  bool isUsed(int y) const { return isUsed_[y] != 0; } ///< false: the row is empty
  std::uint64_t* row(int y);                           ///< the row is used from now on
  const std::uint64_t* row(int y) const { return isUsed(y) ? bits_.data() + std::ptrdiff_t{words_} * y : none_.data(); }

  void set(int x, int y) { row(y)[x / wordBits] |= std::uint64_t{1} << (x % wordBits); }
  bool has(int x, int y) const { return row(y)[x / wordBits] >> (x % wordBits) & 1; }
  void setRange(int begin, int end, int y); ///< x in [begin, end), clipped to the row
  void clear() { isUsed_.assign(isUsed_.size(), 0); }
  void keepWithin(int begin, int endX, int endY); ///< keeps x in [begin, endX) of the rows [begin, endY)
  bool empty() const;
  void unite(const MaskPlane& other);
  void intersect(const MaskPlane& other);
  void subtract(const MaskPlane& other);
  void growAlongX(int steps); ///< to both sides
  void growAlongY(int steps);
  void growUpwards();     ///< by the next voxel along x, along y and along both: a cell's lowest voxel becomes the cell
  void growCrosswise();   ///< by the four neighbors in the plane
  void shrinkCrosswise(); ///< to the voxels whose four neighbors in the plane are set

private:
  std::uint64_t lastWord() const; ///< the bits of a row's last word that are voxels
  bool mayHave(int y) const { return y >= 0 && y < size_.y && isUsed(y); }

  GridSize size_;
  int words_ = 0;
  std::vector<std::uint64_t> none_; ///< an empty row
  std::vector<std::uint8_t> isUsed_;
  std::vector<std::uint64_t, UninitializedAllocator<std::uint64_t>> bits_; ///< of used rows
};

/// Calls body(index of the word, first bit in it, number of bits, first voxel) for the voxels [begin, end) of a row.
template <typename Body>
void forEachWord(int begin, int end, const Body& body)
{
  while (begin < end) {
    const int bit = begin % MaskPlane::wordBits, bits = std::min(end - begin, MaskPlane::wordBits - bit);
    body(begin / MaskPlane::wordBits, bit, bits, begin);
    begin += bits;
  }
}

/// The bits of the voxels after those of word w of a row, which has `words` words; none follows the last one.
inline std::uint64_t nextBits(const std::uint64_t* row, int w, int words)
{
  return row[w] >> 1 | (w + 1 < words ? row[w + 1] << (MaskPlane::wordBits - 1) : 0);
}

/// Sets the bits of the voxels [begin, end) of a row.
inline void setBits(std::uint64_t* words, int begin, int end)
{
  forEachWord(begin, end, [&](int word, int bit, int bits, int) {
    words[word] |= (~std::uint64_t{0} >> (MaskPlane::wordBits - bits)) << bit;
  });
}

/// Sets the bits of those voxels [begin, end) of a row whose values are negative. \param values from `begin` on
inline void setNegativeBits(std::uint64_t* words, int begin, int end, const float* values)
{
  forEachWord(begin, end, [&](int word, int bit, int bits, int voxel) {
    std::uint64_t negative = 0;
    for (int b = 0; b < bits; ++b)
      negative |= std::uint64_t{values[voxel - begin + b] < 0} << b;
    words[word] |= negative << bit;
  });
}

/// Consecutive voxels of one row.
struct Run {
  std::int32_t at; ///< window index of the first voxel
  std::int32_t count;
  std::uint32_t first; ///< index of its first value in the plane's packed values
};

/// The runs of consecutive rows.
struct Runs {
  const Run* begins = nullptr;
  const Run* ends = nullptr;
  std::int32_t origin = 0; ///< window index of voxel 0 of the row, if the runs are those of one row
  const Run* begin() const { return begins; }
  const Run* end() const { return ends; }
};

/// A set of voxels of a grid.
class VoxelSet {
public:
  /// Sets the bits of plane z of an empty mask.
  using Fill = std::function<void(int z, MaskPlane& mask)>;

  VoxelSet() = default;

  /// \param fill called concurrently
  /// \throw ResourceLimit if the grid or its runs are too many for 32-bit numbers
  /// \param roundUpTo runs are lengthened to multiples of 8 voxels, but end before this x; 0: they stay as they are
  VoxelSet(GridSize size, Execution& execution, const Fill& fill, int roundUpTo = 0);

  /// \param makeFill called for each piece of consecutive planes; its Fill is called for them in ascending order
  static VoxelSet inPieces(GridSize size, Execution& execution, const std::function<Fill()>& makeFill);

  GridSize size() const { return size_; }
  std::int64_t count() const { return planeFirst_.empty() ? 0 : planeFirst_.back(); }
  bool contains(int x, int y, int z) const { return find(x, y, z) >= 0; }

  /// True if all of (x, y, z)..(x + 1, y + 1, z + 1) are in the band.
  bool containsCell(int x, int y, int z) const
  {
    const auto hasEdge = [&](int row, int plane) { return contains(x, row, plane) && contains(x + 1, row, plane); };
    return hasEdge(y, z) && hasEdge(y + 1, z) && hasEdge(y, z + 1) && hasEdge(y + 1, z + 1);
  }

  /// Index of a voxel's packed value; −1 if it is not in the band.
  std::int64_t find(int x, int y, int z) const
  {
    if (!size_.contains(x, y, z))
      return -1;
    return findInRow(windowIndex(x, y), 1, y, z);
  }

  /// The same for the voxel with window index `at`; also −1 if the `count` voxels from it on are not all in one run.
  std::int64_t findInRow(std::int32_t at, int count, int y, int z) const
  {
    const Runs runs = row(y, z);
    for (const Run* run = runs.ends; run != runs.begins;)
      if ((--run)->at <= at)
        return at + count <= run->at + run->count ? planeFirst(z) + run->first + (at - run->at) : -1;
    return -1;
  }

  /// Packed values of plane z are [planeFirst(z), planeFirst(z + 1)). Planes outside of the grid are empty.
  std::int64_t planeFirst(int z) const { return planeFirst_[z < 0 ? 0 : z > size_.z ? size_.z : z]; }
  std::int64_t planeCount(int z) const { return planeFirst(z + 1) - planeFirst(z); }
  std::int64_t largestPlane() const { return largestPlane_; }

  Runs row(int y, int z) const
  {
    const std::int64_t at = y + std::int64_t{size_.y} * z;
    return {runs_.data() + rowBegin_[at], runs_.data() + rowBegin_[at + 1], windowIndex(0, y)};
  }
  /// The planes [bottom, top) hold all voxels.
  int bottom() const { return bottom_; }
  int top() const { return top_; }

  /// True if two planes have the same voxels, and all planes between them as well, as on whole levels.
  bool areAlike(int z, int other) const
  {
    const auto isInGrid = [this](int plane) { return plane >= 0 && plane < size_.z; };
    return isInGrid(z) && isInGrid(other) && likeFirst_[z] == likeFirst_[other];
  }
  Runs plane(int z) const
  {
    if (z < 0 || z >= size_.z)
      return {};
    return {row(0, z).begins, row(size_.y - 1, z).ends, 0};
  }

  /// Distance of rows in a window. A window has one row more before the first and after the last one.
  int windowStride() const { return static_cast<int>(windowStrideOf(size_)); }
  /// Voxels of a window, an odd number of vectors: windows whole pages apart would drive each other out of the cache.
  std::size_t windowCount() const
  {
    return static_cast<std::size_t>(windowStride()) * static_cast<std::size_t>(size_.y + 2) | vectorUnit;
  }
  std::int32_t windowIndex(int x, int y) const { return (y + 1) * windowStride() + x + windowMargin; }
  int xOf(const Run& run, int y) const { return run.at - windowIndex(0, y); }

  /// Calls body(run, x of its first voxel, y) for the runs of plane z, row by row. Planes outside of the grid are
  /// empty.
  template <typename Body>
  void forRuns(int z, const Body& body) const
  {
    if (z < 0 || z >= size_.z || planeCount(z) == 0)
      return;
    for (int y = 0; y < size_.y; ++y)
      for (const Run& run : row(y, z))
        body(run, xOf(run, y), y);
  }

  /// Sets the bits of plane z.
  void rasterize(int z, MaskPlane& mask) const;

  std::size_t bytes() const;

  /// For Boost's archives.
  template <typename Archive>
  void serialize(Archive& archive, unsigned)
  {
    (void)(archive & size_ & runs_ & rowBegin_ & planeFirst_ & likeFirst_ & largestPlane_ & bottom_ & top_);
  }

private:
  /// \param pieceSize planes that one Fill is called for
  void build(GridSize size, const std::function<Fill()>& makeFill, int roundUpTo, int pieceSize, Execution& execution);
  std::int64_t addRow(const MaskPlane& mask, int y, int roundUpTo, std::int64_t values, std::vector<Run>& runs) const;

  GridSize size_;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> rowBegin_;  ///< per row of the grid, and the end
  std::vector<std::int64_t> planeFirst_; ///< per plane, and the end
  std::vector<std::int32_t> likeFirst_;  ///< per plane: the first of the consecutive planes with the same voxels
  std::int64_t largestPlane_ = 0;
  int bottom_ = 0, top_ = 0;
};

/// Calls body(packed index on the band, packed index on the support, count) for the runs of plane z.
/// \pre the support contains the band; each run of the band lies in one run of the support
template <typename Body>
void forEachPair(const VoxelSet& band, const VoxelSet& support, int z, const Body& body)
{
  for (int y = 0; y < band.size().y; ++y) {
    const Run* outer = support.row(y, z).begins;
    for (const Run& run : band.row(y, z)) {
      while (outer->at + outer->count <= run.at)
        ++outer;
      body(band.planeFirst(z) + run.first, support.planeFirst(z) + outer->first + (run.at - outer->at), run.count);
    }
  }
}

/// The voxels that are at most `steps` voxels away from one of the band along y and z, and at most `stepsX` along x.
VoxelSet dilated(const VoxelSet& band, int steps, int stepsX, Execution& execution);

/// The voxels of a band that have all voxels at most `steps` edges of the lattice away in the band, too.
VoxelSet eroded(const VoxelSet& band, int steps, Execution& execution);

/// How many of the six neighbors of each voxel are in the band, packed. They are floats because stencils would need
/// more time to convert bytes than to sum up.
PackedValues degrees(const VoxelSet& band, Execution& execution);

/// The connected parts of a band that hold a voxel of another one.
VoxelSet connectedTo(VoxelSet band, const VoxelSet& other, Execution& execution);

/// \name Work on the runs of a plane: windows are dense, packed arrays start at the plane's first value
/// @{
namespace kernels {
/// Three windows that lie above each other, as a stencil along the axes reads them.
struct Planes {
  int stride; ///< from row to row
  const float *below, *center, *above;
};
/// A Chebyshev step: z becomes f z + g D⁻¹ (b − product) and is added to x. z, b and D⁻¹ are packed, x is a window.
struct ChebyshevStep {
  float f, g;
  const float *b, *inverseD;
  float *z, *x;
};

void fill(Runs runs, float value, float* window);
void load(Runs runs, const float* packed, float* window);
void store(Runs runs, const float* window, float* packed);
void addToWindow(Runs runs, float a, const float* packed, float* window);
/// window = a ∘ window + packed, a packed
void scaleAndAdd(Runs runs, const float* a, const float* packed, float* window);
/// packed = Σ of the six neighbors
void sumNeighbors(Runs runs, Planes planes, float* packed);
/// out = L x, L that of the band's graph, whose voxels have `degrees` neighbors (packed); windows are zero outside the
/// runs. Without degrees L is that of the lattice; then the windows must have the values of all neighbors.
void laplacian(Runs runs, const float* degrees, Planes planes, float* out);
/// out += L x
void addLaplacian(Runs runs, const float* degrees, Planes planes, float* out);
/// out += a x, both windows
void addWindow(Runs runs, float a, const float* x, float* out);
/// First Chebyshev step from zero: x = z = g D⁻¹ b; z is packed.
void startChebyshev(Runs runs, float g, const float* b, const float* inverseD, float* z, float* x);
void stepChebyshev(Runs runs, ChebyshevStep step, const float* product);
/// The same with product + L y + tension · tense in the place of product: adding the last power of L, L y, then needs
/// no pass of its own. \param tense a window, or none
void stepChebyshevWithLaplacian(Runs runs, ChebyshevStep step, const float* product, const float* degrees, Planes y,
                                float tension, const float* tense);
/// r = b − product; r and b may be the same.
void residual(Runs runs, const float* product, const float* b, float* r);
/// product += w x, w packed
void addWeighted(Runs runs, const float* w, const float* x, float* product);
} // namespace kernels
/// @}

} // namespace pcl::mrf

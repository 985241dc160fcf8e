// SPDX-License-Identifier: BSD-3-Clause
#include "field/grid_transfer.h"

#include "base/multiversioning.h"
#include "field/interpolation.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pcl::mrf {
namespace {

struct WeightedRow {
  const float* values;
  float weight;
};

/// Sum of four rows; all arrays start at the first of `count` voxels.
MRF_MULTIVERSION(void, combineFour,
                 (int count, WeightedRow a, WeightedRow b, WeightedRow c, WeightedRow d, float* __restrict out),
                 (count, a, b, c, d, out))
{
  for (int i = 0; i < count; ++i)
    out[i] = (a.weight * a.values[i] + b.weight * b.values[i]) + (c.weight * c.values[i] + d.weight * d.values[i]);
}

/// Cubic values of consecutive fine voxels; row[n] belongs to coarse voxel n relative to the first fine one's parent.
MRF_MULTIVERSION(void, cubicRow, (int count, bool startsWithSecond, const float* row, float* __restrict out),
                 (count, startsWithSecond, row, out))
{
  int i = 0;
  const auto second = [=](const float* r) {
    return cubicWeights[0] * r[-1] + cubicWeights[1] * r[0] + cubicWeights[2] * r[1] + cubicWeights[3] * r[2];
  };
  const auto first = [=](const float* r) {
    return cubicWeights[0] * r[1] + cubicWeights[1] * r[0] + cubicWeights[2] * r[-1] + cubicWeights[3] * r[-2];
  };
  if (startsWithSecond && count > 0)
    out[i++] = second(row++);
  const int pairs = (count - i) / 2;
  float* const o = out + i;
  for (int p = 0; p < pairs; ++p) {
    o[2 * p] = first(row + p);
    o[2 * p + 1] = second(row + p);
  }
  if ((count - i) % 2 != 0)
    o[2 * pairs] = first(row + pairs);
}

/// window += linear interpolation of consecutive fine voxels.
MRF_MULTIVERSION(void, addLinearRow, (int count, bool startsWithSecond, const float* row, float* __restrict out),
                 (count, startsWithSecond, row, out))
{
  int i = 0;
  const auto second = [=](const float* r) { return .75f * r[0] + .25f * r[1]; };
  const auto first = [=](const float* r) { return .75f * r[0] + .25f * r[-1]; };
  if (startsWithSecond && count > 0)
    out[i++] += second(row++);
  const int pairs = (count - i) / 2;
  float* const o = out + i;
  for (int p = 0; p < pairs; ++p) {
    o[2 * p] += first(row + p);
    o[2 * p + 1] += second(row + p);
  }
  if ((count - i) % 2 != 0)
    o[2 * pairs] += first(row + pairs);
}

/// out[j] = scale · Σ of the fine values around coarse voxel j; fine[2 j] is its first child.
MRF_MULTIVERSION(void, restrictRow, (int count, float scale, const float* fine, float* __restrict out),
                 (count, scale, fine, out))
{
  for (int j = 0; j < count; ++j)
    out[j] = scale * (.75f * (fine[2 * j] + fine[2 * j + 1]) + .25f * (fine[2 * j - 1] + fine[2 * j + 2]));
}

void prepare(std::vector<float>& values, std::size_t count)
{
  if (values.size() < count)
    values.resize(count, 0);
}

/// Adds weighted planes of a band to a window, and clears the window in the destructor.
class CombinedPlanes {
public:
  CombinedPlanes(const PackedField& field, std::vector<float>& window) : band_(field.voxels), values_(field.values)
  {
    prepare(window, band_.windowCount());
    window_ = window.data();
  }
  ~CombinedPlanes()
  {
    for (int n = 0; n < used_; ++n)
      kernels::fill(band_.plane(planes_[n]), 0, window_);
  }
  CombinedPlanes(const CombinedPlanes&) = delete;
  CombinedPlanes& operator=(const CombinedPlanes&) = delete;

  void add(int z, float weight)
  {
    if (band_.planeCount(z) == 0)
      return;
    kernels::addToWindow(band_.plane(z), weight, values_ + band_.planeFirst(z), window_);
    planes_[used_++] = z;
  }

  /// The row of the window, from voxel x on; rows outside of the grid are zero.
  const float* row(int x, int y) const { return window_ + band_.windowIndex(x, std::clamp(y, -1, band_.size().y)); }

private:
  const VoxelSet& band_;
  const float* values_;
  float* window_ = nullptr;
  std::array<int, 4> planes_{};
  int used_ = 0;
};

} // namespace

Refinement::Refinement(const Lattice& coarse, const Lattice& fine)
{
  const Eigen::Vector3d offset = (fine.origin - coarse.origin) / fine.spacing;
  for (int axis = 0; axis < 3; ++axis)
    parity[axis] = static_cast<int>(std::lround(offset[axis] + .5));
  children = (fine.size.x > 1 ? 2 : 1) * (fine.size.y > 1 ? 2 : 1) * (fine.size.z > 1 ? 2 : 1);
}

void interpolatePlane(const PackedField& coarse, const Refinement& refinement, const VoxelSet& fine, int z, float* out,
                      TransferScratch& scratch)
{
  if (fine.planeCount(z) == 0)
    return;
  CombinedPlanes planes(coarse, scratch.window);
  const int parentZ = refinement.parent(z, 2), sideZ = refinement.isSecond(z, 2) ? 1 : -1;
  for (int tap = 0; tap < 4; ++tap)
    planes.add(parentZ + sideZ * (tap - 1), cubicWeights[tap]);
  prepare(scratch.rows, coarse.voxels.size().x + 16);
  for (int y = 0; y < fine.size().y; ++y) {
    const int parentY = refinement.parent(y, 1), sideY = refinement.isSecond(y, 1) ? 1 : -1;
    for (const Run& run : fine.row(y, z)) {
      const int x = fine.xOf(run, y);
      const int begin = refinement.parent(x, 0) - 2, end = refinement.parent(x + run.count - 1, 0) + 3;
      const auto row = [&](int tap) {
        return WeightedRow{planes.row(begin, parentY + sideY * (tap - 1)), cubicWeights[tap]};
      };
      combineFour(end - begin, row(0), row(1), row(2), row(3), scratch.rows.data());
      cubicRow(run.count, refinement.isSecond(x, 0), scratch.rows.data() + 2, out + run.first);
    }
  }
}

void addProlonged(const PackedField& coarse, const Refinement& refinement, const VoxelSet& fine, int z, float* window,
                  TransferScratch& scratch)
{
  if (fine.planeCount(z) == 0)
    return;
  CombinedPlanes planes(coarse, scratch.window);
  const int parentZ = refinement.parent(z, 2);
  planes.add(parentZ, .75f);
  planes.add(parentZ + (refinement.isSecond(z, 2) ? 1 : -1), .25f);
  prepare(scratch.rows, coarse.voxels.size().x + 16);
  for (int y = 0; y < fine.size().y; ++y) {
    const int parentY = refinement.parent(y, 1), otherY = parentY + (refinement.isSecond(y, 1) ? 1 : -1);
    for (const Run& run : fine.row(y, z)) {
      const int x = fine.xOf(run, y);
      const int begin = refinement.parent(x, 0) - 1, end = refinement.parent(x + run.count - 1, 0) + 2;
      const float *near = planes.row(begin, parentY), *far = planes.row(begin, otherY);
      combineFour(end - begin, {near, .75f}, {far, .25f}, {near, 0}, {far, 0}, scratch.rows.data());
      addLinearRow(run.count, refinement.isSecond(x, 0), scratch.rows.data() + 1, window + run.at);
    }
  }
}

void restrictPlane(const PackedField& fine, const Refinement& refinement, float scale, const VoxelSet& coarse, int z,
                   float* out, TransferScratch& scratch)
{
  if (coarse.planeCount(z) == 0)
    return;
  CombinedPlanes planes(fine, scratch.window);
  const int firstZ = refinement.firstChild(z, 2);
  planes.add(firstZ - 1, .25f);
  planes.add(firstZ, .75f);
  planes.add(firstZ + 1, .75f);
  planes.add(firstZ + 2, .25f);
  prepare(scratch.rows, 2 * coarse.size().x + 16);
  for (int y = 0; y < coarse.size().y; ++y) {
    const int firstY = refinement.firstChild(y, 1);
    for (const Run& run : coarse.row(y, z)) {
      // The children of the run's voxels and one fine voxel on either side, clipped to what a window holds.
      const int x = refinement.firstChild(coarse.xOf(run, y), 0);
      const int begin = std::max(x - 1, -2), end = std::min(x + 2 * run.count + 1, fine.voxels.size().x + 2);
      float* const row = scratch.rows.data();
      std::fill_n(row, 2 * run.count + 2, 0.f);
      const auto source = [&](int step, float weight) { return WeightedRow{planes.row(begin, firstY + step), weight}; };
      if (end > begin)
        combineFour(end - begin, source(-1, .25f), source(0, .75f), source(1, .75f), source(2, .25f),
                    row + (begin - (x - 1)));
      restrictRow(run.count, scale, row + 1, out + run.first);
    }
  }
}

VoxelSet coarsened(const VoxelSet& fine, const GridSize& coarse, const Refinement& refinement, Execution& execution)
{
  return VoxelSet(coarse, execution, [&](int z, MaskPlane& mask) {
    const int firstZ = refinement.firstChild(z, 2);
    for (const int child : {firstZ, firstZ + 1})
      fine.forRuns(child, [&](const Run& run, int x, int y) {
        mask.setRange(refinement.parent(x, 0), refinement.parent(x + run.count - 1, 0) + 1, refinement.parent(y, 1));
      });
  });
}

} // namespace pcl::mrf

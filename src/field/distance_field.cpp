// SPDX-License-Identifier: BSD-3-Clause
#include "field/field_contents.h"
#include "field/field_sampler.h"
#include "field/grid_transfer.h"

#include <pcl/surface/mrf/distance_field.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <iterator>
#include <stdexcept>

namespace pcl::mrf {
namespace {

/// Voxels around the lattice of a piece that count as its own: a position traced along the field may leave it a little.
constexpr double voxelsAroundPiece = 4;

/// The cell around a position and the weights of its 8 voxels.
struct Cell {
  Eigen::Array3i voxel; ///< the lowest of the 8
  float u, v, w;        ///< place of the position in the cell along x, y and z, 0 to 1

  Cell(const Lattice& lattice, const Eigen::Vector3f& position)
  {
    const Eigen::Vector3d x = lattice.toVoxels(position);
    place(x.x(), lattice.size.x, voxel.x(), u);
    place(x.y(), lattice.size.y, voxel.y(), v);
    place(x.z(), lattice.size.z, voxel.z(), w);
  }

  /// A coordinate outside the lattice is moved to its border. NaN, for which all comparisons are false, becomes 0.
  static void place(double coordinate, int size, int& index, float& fraction)
  {
    const double clamped = std::min(std::max(0.0, coordinate), static_cast<double>(size - 1));
    index = std::min(static_cast<int>(clamped), size - 2);
    fraction = static_cast<float>(clamped - index);
  }

  /// Trilinear interpolation of the values at the 8 voxels, x first.
  template <typename Value>
  Value interpolate(const std::array<Value, 8>& values) const
  {
    const auto alongX = [&](std::size_t n) -> Value { return (1 - u) * values[n] + u * values[n + 1]; };
    const auto inPlane = [&](std::size_t n) -> Value { return (1 - v) * alongX(n) + v * alongX(n + 2); };
    return (1 - w) * inPlane(0) + w * inPlane(4);
  }
};

/// The values that central differences at the voxels of a cell read: a box of up to 4 × 4 × 4 voxels.
class CellSurroundings {
public:
  CellSurroundings(const GridSize& size, const Eigen::Array3i& cell)
      : cell_(cell), lower_((cell - 1).max(0)), upper_((cell + 3).min(Eigen::Array3i(size.x, size.y, size.z)))
  {}

  /// Calls read(x, y, z, count, out) for each row that the differences need: not for the four at the edges of the box.
  template <typename Read>
  void readRows(const Read& read)
  {
    const auto isInside = [](int index, int of) { return index == of || index == of + 1; };
    for (int k = lower_.z(); k < upper_.z(); ++k)
      for (int j = lower_.y(); j < upper_.y(); ++j)
        if (isInside(j, cell_.y()) || isInside(k, cell_.z()))
          read(lower_.x(), j, k, upper_.x() - lower_.x(), &at({lower_.x(), j, k}));
  }

  /// Gradient and distance at a voxel. Differences are one-sided at the lattice's border: the divisor is the number of
  /// voxel sides between the two values.
  Eigen::Array4f sample(const Eigen::Array3i& voxel, float inverseSpacing)
  {
    const Eigen::Array3i below = (voxel - 1).max(lower_), above = (voxel + 1).min(upper_ - 1);
    const auto difference = [&](int axis) {
      Eigen::Array3i from = voxel, to = voxel;
      from[axis] = below[axis];
      to[axis] = above[axis];
      return (at(to) - at(from)) * inverseSpacing / static_cast<float>(above[axis] - below[axis]);
    };
    return {difference(0), difference(1), difference(2), at(voxel)};
  }

private:
  static constexpr int side = 4;

  float& at(const Eigen::Array3i& voxel)
  {
    const Eigen::Array3i offset = voxel - cell_ + 1;
    return values_[offset.x() + side * (offset.y() + side * offset.z())];
  }

  Eigen::Array3i cell_, lower_, upper_; ///< the box is [lower_, upper_)
  std::array<float, side * side * side> values_;
};

} // namespace

DistanceField::DistanceField(const Lattice& lattice, std::vector<float> distances, std::vector<float> confidences)
    : stored_(lattice), lattice_(lattice), distances_(std::move(distances)), confidences_(std::move(confidences))
{
  const auto count = static_cast<std::size_t>(lattice_.size.count());
  if (distances_.size() != count || (!confidences_.empty() && confidences_.size() != count) ||
      std::min({lattice_.size.x, lattice_.size.y, lattice_.size.z}) < 2)
    throw std::invalid_argument(
        "DistanceField: needs at least 2 voxels along each axis and one value of each kind per voxel");
}

DistanceField::DistanceField(const Lattice& lattice, std::shared_ptr<const BandedDistances> distances, AxisOrder axes)
    : stored_(lattice), axes_(axes), lattice_(axes.fromStored(lattice)), banded_(std::move(distances))
{
  const auto count = static_cast<std::size_t>(banded_->band.count());
  if (banded_->values.size() != count || (!banded_->confidences.empty() && banded_->confidences.size() != count) ||
      banded_->band.size() != withMargin(stored_.size) || banded_->background.empty())
    throw std::invalid_argument("DistanceField: needs one value of each kind per voxel of the band, and a background");
}

/// The other pieces, and boxes around them sorted by their lower ends along x: not all have to be asked for a position.
struct DistanceField::OtherPieces {
  struct Box {
    Eigen::AlignedBox3d box;
    std::size_t field;
    double farthest; ///< largest upper end along x of this box and of all before it
  };
  std::vector<DistanceField> fields;
  std::vector<Box> boxes;
};

DistanceField DistanceField::ofPieces(std::vector<DistanceField> pieces)
{
  DistanceField result = pieces.front();
  if (pieces.size() == 1)
    return result;
  auto others = std::make_shared<OtherPieces>();
  others->fields.assign(std::make_move_iterator(pieces.begin() + 1), std::make_move_iterator(pieces.end()));
  for (std::size_t n = 0; n < others->fields.size(); ++n) {
    const Lattice& lattice = others->fields[n].lattice();
    const Eigen::Vector3d size(lattice.size.x, lattice.size.y, lattice.size.z),
        around = Eigen::Vector3d::Constant(voxelsAroundPiece * lattice.spacing);
    others->boxes.push_back({{lattice.origin - around, lattice.origin + lattice.spacing * size + around}, n, 0});
  }
  std::stable_sort(others->boxes.begin(), others->boxes.end(),
                   [](const auto& a, const auto& b) { return a.box.min().x() < b.box.min().x(); });
  double farthest = others->boxes.front().box.max().x();
  for (auto& entry : others->boxes)
    entry.farthest = farthest = std::max(farthest, entry.box.max().x());
  result.others_ = std::move(others);
  return result;
}

const std::vector<DistanceField>& DistanceField::otherPieces() const
{
  static const std::vector<DistanceField> none;
  return others_ ? others_->fields : none;
}

const DistanceField& DistanceField::pieceAt(const Eigen::Vector3f& position) const
{
  if (!others_)
    return *this;
  const Eigen::Vector3d at = position.cast<double>();
  const auto& boxes = others_->boxes;
  auto next = std::upper_bound(boxes.begin(), boxes.end(), at.x(),
                               [](double x, const auto& entry) { return x < entry.box.min().x(); });
  while (next != boxes.begin() && (--next)->farthest >= at.x())
    if (next->box.contains(at))
      return others_->fields[next->field];
  return *this;
}

const DistanceField* DistanceField::coarserBand() const
{
  const bool isBehind = banded_ && banded_->background.banded_ && banded_->background.stored_.spacing > stored_.spacing;
  return isBehind ? &banded_->background : nullptr;
}

double DistanceField::voxelSide(const Eigen::Vector3f& position) const
{
  const DistanceField& piece = pieceAt(position);
  return piece.bandAt(piece.axes_.toStored(position)).stored_.spacing;
}

const DistanceField& DistanceField::bandAt(const Eigen::Vector3f& stored) const
{
  const DistanceField* band = this;
  for (const DistanceField* next = coarserBand(); next; next = next->coarserBand()) {
    const Eigen::Array3i cell = Cell(band->stored_, stored).voxel;
    if (band->storesCell(cell.x(), cell.y(), cell.z()))
      break;
    band = next;
  }
  return *band;
}

DistanceField DistanceField::inStoredAxes() const
{
  return banded_ ? DistanceField(stored_, banded_) : *this;
}

bool DistanceField::hasConfidences() const
{
  return !(banded_ ? banded_->confidences : confidences_).empty();
}

std::int64_t DistanceField::packedIndex(int i, int j, int k) const
{
  const Eigen::Array3i at = axes_.toStored(Eigen::Array3i(i, j, k)) + gridMargin;
  return banded_->band.find(at.x(), at.y(), at.z());
}

float DistanceField::confidence(int i, int j, int k) const
{
  if (!banded_)
    return confidences_[lattice_.size.index(i, j, k)];
  const std::int64_t at = packedIndex(i, j, k);
  return at < 0 ? 0 : banded_->confidences[at];
}

float DistanceField::bandedDistance(int i, int j, int k) const
{
  const Eigen::Array3i at = axes_.toStored(Eigen::Array3i(i, j, k));
  return storedDistance(at.x(), at.y(), at.z());
}

float DistanceField::storedDistance(int i, int j, int k) const
{
  if (!banded_)
    return distances_[stored_.size.index(i, j, k)];
  const std::int64_t at = banded_->band.find(i + gridMargin, j + gridMargin, k + gridMargin);
  return at < 0 ? banded_->background.sampleDistance(stored_.position(i, j, k)) : banded_->values[at];
}

bool DistanceField::bandHasCell(int i, int j, int k) const
{
  const Eigen::Array3i at = axes_.toStored(Eigen::Array3i(i, j, k));
  return storesCell(at.x(), at.y(), at.z());
}

bool DistanceField::storesCell(int i, int j, int k) const
{
  return banded_->band.containsCell(i + gridMargin, j + gridMargin, k + gridMargin);
}

void DistanceField::signsOfRow(int j, int k, std::uint64_t* words) const
{
  constexpr int wordBits = MaskPlane::wordBits;
  const int count = lattice_.size.x;
  std::fill_n(words, (count + wordBits - 1) / wordBits, std::uint64_t{0});
  if (!banded_) {
    setNegativeBits(words, 0, count, distances_.data() + lattice_.size.index(0, j, k));
    return;
  }
  if (!axes_.isNatural()) {
    bool isNegative = distance(0, j, k) < 0;
    for (int i = 0; i < count; ++i) {
      if (const std::int64_t at = packedIndex(i, j, k); at >= 0)
        isNegative = banded_->values[at] < 0;
      if (isNegative)
        setBits(words, i, i + 1);
    }
    return;
  }
  const VoxelSet& band = banded_->band;
  int done = 0;
  bool isNegative = banded_->background.sampleDistance(lattice_.position(0, j, k)) < 0;
  for (const Run& run : band.row(j + gridMargin, k + gridMargin)) {
    const int first = band.xOf(run, j + gridMargin) - gridMargin;
    const float* values = banded_->values.data() + band.planeFirst(k + gridMargin) + run.first;
    const int begin = std::max(first, 0), end = std::min(first + run.count, count);
    if (isNegative)
      setBits(words, done, begin);
    setNegativeBits(words, begin, end, values + (begin - first));
    done = std::max(end, done);
    isNegative = values[run.count - 1] < 0;
  }
  if (isNegative)
    setBits(words, done, count);
}

std::size_t DistanceField::bytes() const
{
  std::size_t result = (distances_.capacity() + confidences_.capacity()) * sizeof(float);
  if (banded_)
    result += banded_->band.bytes() + (banded_->values.capacity() + banded_->confidences.capacity()) * sizeof(float) +
              banded_->background.bytes();
  for (const DistanceField& piece : otherPieces())
    result += piece.bytes();
  return result;
}

void DistanceField::distancesOfRow(int i, int j, int k, int count, float* out) const
{
  if (!banded_) {
    std::copy_n(distances_.data() + stored_.size.index(i, j, k), count, out);
    return;
  }
  const VoxelSet& band = banded_->band;
  const int y = j + gridMargin, z = k + gridMargin;
  const std::int64_t first = band.findInRow(band.windowIndex(i + gridMargin, y), count, y, z);
  constexpr int mostly = 4; // the usual count: copying a constant number of values needs no call
  if (first >= 0 && count == mostly)
    std::copy_n(banded_->values.data() + first, mostly, out);
  else if (first >= 0)
    std::copy_n(banded_->values.data() + first, count, out);
  else
    for (int n = 0; n < count; ++n)
      out[n] = storedDistance(i + n, j, k);
}

float DistanceField::sampleDistance(const Eigen::Vector3f& position) const
{
  const DistanceField& piece = pieceAt(position);
  const Eigen::Vector3f stored = piece.axes_.toStored(position);
  const DistanceField& band = piece.bandAt(stored);
  const Cell cell(band.stored_, stored);
  std::array<float, 8> values;
  for (int n = 0; n < 4; ++n)
    band.distancesOfRow(cell.voxel.x(), cell.voxel.y() + n % 2, cell.voxel.z() + n / 2, 2, &values[2 * n]);
  return cell.interpolate(values);
}

Eigen::Vector3f DistanceField::sampleGradient(const Eigen::Vector3f& position) const
{
  Eigen::Vector3f gradient;
  sampleDistance(position, gradient);
  return gradient;
}

float DistanceField::sampleDistance(const Eigen::Vector3f& position, Eigen::Vector3f& gradient) const
{
  return FieldSampler(*this).sampleDistance(position, gradient);
}

float FieldSampler::sampleDistance(const Eigen::Vector3f& position, Eigen::Vector3f& gradient)
{
  const DistanceField& piece = field_.pieceAt(position);
  const Eigen::Vector3f stored = piece.axes_.toStored(position);
  const DistanceField& band = piece.bandAt(stored);
  const Cell cell(band.stored_, stored);
  if (&band != band_ || (cell.voxel != cell_).any())
    enter(band, cell.voxel);
  const Eigen::Array4f sample = cell.interpolate(corners_);
  gradient = piece.axes_.fromStored(Eigen::Vector3f(sample.head<3>()));
  return sample[3];
}

float FieldSampler::spacing() const
{
  return static_cast<float>(band_->stored_.spacing);
}

void FieldSampler::enter(const DistanceField& band, const Eigen::Array3i& cell)
{
  band_ = &band;
  cell_ = cell;
  CellSurroundings surroundings(band.stored_.size, cell);
  surroundings.readRows([&](int i, int j, int k, int count, float* out) { band.distancesOfRow(i, j, k, count, out); });
  const auto inverse = static_cast<float>(1 / band.stored_.spacing);
  for (int n = 0; n < 8; ++n)
    corners_[n] = surroundings.sample(cell + Eigen::Array3i(n % 2, n / 2 % 2, n / 4), inverse);
}

} // namespace pcl::mrf

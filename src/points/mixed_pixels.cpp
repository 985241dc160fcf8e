// SPDX-License-Identifier: BSD-3-Clause
#include "points/mixed_pixels.h"

#include "base/select_values.h"
#include "points/local_plane.h"
#include "points/sensor_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace pcl::mrf {
namespace {

/// Number of neighbors of a point in its sensor's view.
constexpr int besides = 16;

/// There are two surfaces if at least atEither neighbors lie near the front, at least atEither near the back, and in
/// sum at least atBoth. Front and back are the smallest and the largest range of the neighbors. Near means
/// within nearEnd of the way from front to back, or within the noise. On a slope the ranges are spread evenly.
constexpr float nearEnd = .1f;
constexpr std::ptrdiff_t atEither = 2, atBoth = besides / 2;

/// A neighbor is at the range of the point if the ranges differ by less than `alike` of the way from front to back. A
/// mixed pixel has at most maxAlike such neighbors; one more if more than one in `dense` of the sensor's points are
/// mixed, because mixed pixels are then next to each other. The leaves of a tree have more.
constexpr float alike = .05f;
constexpr std::ptrdiff_t maxAlike = 1;
constexpr std::size_t dense = 200;

/// A point is off a surface if its range differs by more than `clearly` times the step at the surface's range. The step
/// is the quantile `typical` of how much points of that range differ from the median range of their neighbors.
constexpr float clearly = 4;
constexpr double typical = .8;

/// A point with these signs stays if its nearest points are flat, it is off their plane by at most `inPlane` of their
/// radius, and the cosine between the plane's normal and its line of sight is above `crossing`.
constexpr double inPlane = .1, crossing = .15;

/// If fewer than one in `rare` of a sensor's points are mixed, none is dropped.
constexpr std::size_t rare = 4000;

/// A sensor with more than twice this number of points has a sample of this size searched first. If hardly any of the
/// sample is mixed, the other points are not searched.
constexpr std::size_t sampled = 65536;

/// Ranges of the neighbors of a point, ascending.
using Ranges = std::array<float, besides>;

/// The points that one sensor saw, with their ranges.
class DepthView {
public:
  DepthView(const Eigen::Vector3f& sensor, const std::vector<Eigen::Vector3f>& positions, Execution& execution)
      : view_(sensor, positions, execution), ranges_(view_.distances())
  {
    measureSteps();
  }

  /// \param maxOthers max number of neighbors at the range of a mixed pixel \return one flag per point
  std::vector<std::uint8_t> findMixed(std::ptrdiff_t maxOthers, Execution& execution) const
  {
    std::vector<std::uint8_t> mixed(ranges_.size(), 0);
    view_.search().forEachPosition(view_.seen(), besides + 1, NeighborSearch::Answer::indicesAndDistances, execution,
                                   [&](const NeighborBatch& batch) {
                                     for (std::size_t n = 0; n < batch.size; ++n)
                                       mixed[batch.positions[n]] =
                                           isMixed(batch.positions[n], batch.indices + n * batch.k, maxOthers) ? 1 : 0;
                                   });
    return mixed;
  }

private:
  /// The group of a range: a quarter of an octave. Points at the sensor itself, with range 0, are a group of their own.
  static int groupOf(float range)
  {
    return range > 0 ? static_cast<int>(std::floor(4 * std::log2(range))) : std::numeric_limits<int>::min();
  }

  /// \param found besides + 1 indices, in general with the point itself among them
  template <typename Index>
  Ranges rangesOf(const Index* found, std::size_t point) const
  {
    Ranges ranges;
    std::size_t n = 0;
    for (int k = 0; k <= besides && n < ranges.size(); ++k)
      if (static_cast<std::size_t>(found[k]) != point)
        ranges[n++] = ranges_[static_cast<std::size_t>(found[k])];
    std::sort(ranges.begin(), ranges.end());
    return ranges;
  }

  /// Measures, per group of ranges, how much a point's range differs from the median range of its neighbors. Noise,
  /// quantized depths and slopes of the surfaces cause it.
  void measureSteps()
  {
    constexpr std::size_t maxAsked = 8192;
    std::map<int, std::vector<float>> steps;
    Neighbors found;
    for (const std::size_t i : spreadIndices(ranges_.size(), maxAsked)) {
      view_.search().nearest(view_.seen()[i], besides + 1, found);
      steps[groupOf(ranges_[i])].push_back(std::abs(ranges_[i] - rangesOf(found.indices.data(), i)[besides / 2]));
    }
    for (auto& [group, values] : steps)
      steps_[group] = quantile(std::move(values), typical);
  }

  float stepAt(float range) const
  {
    const auto found = steps_.find(groupOf(range));
    return found == steps_.end() ? 0 : found->second;
  }

  bool isMixed(std::uint32_t point, const std::uint32_t* found, std::ptrdiff_t maxOthers) const
  {
    const Ranges ranges = rangesOf(found, point);
    const float range = ranges_[point];
    const float front = ranges.front(), back = ranges.back(), way = back - front;
    const float offFront = clearly * stepAt(front), offBack = clearly * stepAt(back);
    if (range - front <= offFront || back - range <= offBack)
      return false;
    const auto closeTo = [&](float to, float reach) {
      return std::count_if(ranges.begin(), ranges.end(), [&](float other) { return std::abs(other - to) < reach; });
    };
    const std::ptrdiff_t atFront = closeTo(front, std::max(nearEnd * way, offFront)),
                         atBack = closeTo(back, std::max(nearEnd * way, offBack));
    return atFront >= atEither && atBack >= atEither && atFront + atBack >= atBoth &&
           closeTo(range, std::max(alike * way, offFront)) <= maxOthers;
  }

  const SensorView view_;
  const std::vector<float>& ranges_;
  std::map<int, float> steps_;
};

/// Whether the line of sight crosses a surface through its point. It does on a wall between the edge of a roof and the
/// ground, of which the sensor saw little. Sheets of mixed pixels lie along the lines of sight.
bool isCrossed(const std::vector<Eigen::Vector3f>& positions, std::uint32_t point, const Eigen::Vector3f& sensor,
               const NeighborSearch& search, Neighbors& around)
{
  const Eigen::Vector3f& position = positions[point];
  const auto found = static_cast<std::size_t>(search.nearest(position, nearestNeighbors, around));
  const Plane plane = fitPlane(positions, around.indices.data(), found, position);
  const double radius = std::sqrt(double{around.squaredDistances[found - 1]});
  return plane.isSound() && plane.isFlat() && plane.distance <= inPlane * radius &&
         std::abs(plane.normal.dot((position - sensor).cast<double>().normalized())) > crossing;
}

/// The mixed pixels among a sensor's points; none if they are rare.
std::vector<std::uint32_t> mixedAmong(const std::vector<std::uint32_t>& seen, const Eigen::Vector3f& sensor,
                                      const std::vector<Eigen::Vector3f>& positions, std::ptrdiff_t maxOthers,
                                      const NeighborSearch& search, Execution& execution)
{
  std::vector<std::uint32_t> mixed;
  if (seen.size() <= besides)
    return mixed;
  const DepthView view(sensor, selectValues(positions, seen), execution);
  const std::vector<std::uint8_t> isMixed = view.findMixed(maxOthers, execution);
  execution.poll();
  Neighbors around;
  for (std::size_t n = 0; n < seen.size(); ++n)
    if (isMixed[n] && !isCrossed(positions, seen[n], sensor, search, around))
      mixed.push_back(seen[n]);
  if (mixed.size() * rare < seen.size())
    mixed.clear();
  return mixed;
}

} // namespace

std::int64_t dropMixedPixels(const PointArrays& points, const NeighborSearch& search, std::vector<std::uint8_t>& keep,
                             Execution& execution)
{
  std::size_t dropped = 0;
  std::vector<std::vector<std::uint32_t>> own = pointsOfSensors(points);
  const BoundingBox box = boundingBox(points.positions);
  for (std::size_t s = 0; s < own.size(); ++s) {
    std::vector<std::uint32_t>& seen = own[s];
    if ((points.sensors[s] - (box.lower + box.upper) / 2).norm() > maxDiagonals * box.diagonal())
      continue; // it tells the side, as above terrain, and is no device
    const auto mixedOf = [&](const std::vector<std::uint32_t>& asked, std::ptrdiff_t maxOthers) {
      return mixedAmong(asked, points.sensors[s], points.positions, maxOthers, search, execution);
    };
    const auto eraseDropped = [&] {
      seen.erase(std::remove_if(seen.begin(), seen.end(), [&](std::uint32_t i) { return !keep[i]; }), seen.end());
    };
    eraseDropped();
    if (seen.size() > 2 * sampled && mixedOf(selectValues(seen, spreadIndices(seen.size(), sampled)), maxAlike).empty())
      continue;
    // Repeated, because dropping mixed pixels reveals the surfaces next to others.
    for (std::size_t found = 0;;) {
      const std::vector<std::uint32_t> mixed = mixedOf(seen, found * dense > seen.size() ? maxAlike + 1 : maxAlike);
      if (mixed.empty())
        break;
      for (const std::uint32_t i : mixed)
        keep[i] = 0;
      eraseDropped();
      found += mixed.size();
      dropped += mixed.size();
    }
  }
  return static_cast<std::int64_t>(dropped);
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
#include "sampling.h"
#include "point_grid.h"
#include "scanner.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/neighbor_search.h>

#include <shapes/portable_math.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace pcl {
namespace mrf {
namespace scan {

using Eigen::Vector3d;
using portable::dot;
using portable::norm;

void Points::append(const Points& other, std::size_t i)
{
  positions.push_back(other.positions[i]);
  if (!other.normals.empty())
    normals.push_back(other.normals[i]);
  if (!other.views.empty())
    views.push_back(other.views[i]);
}

namespace {

void require(bool holds, const std::string& message)
{
  if (!holds)
    throw InvalidOption(message);
}

/// Decides which sensor sees a point; the surface and the sensors stay the same.
class Visibility {
public:
  Visibility(const Surface& surface, const std::vector<Vector3d>& sensors, const SamplingOptions& options)
      : surface_(surface), sensors_(sensors), options_(options),
        lowestCosine_(portable::sinCos(options.grazingLimit / 360).cosine)
  {}

  /// A random one of the sensors that see the point, -1 if none does; the point's normal is turned towards it.
  /// \param bare the point before it was displaced: what hides it starts there
  std::int32_t choose(const SurfacePoint& bare, SurfacePoint& point, std::uint64_t order) const
  {
    std::vector<std::int32_t> facing;
    for (std::size_t view = 0; view < sensors_.size(); ++view) {
      const Vector3d sight = sensors_[view] - point.position;
      double cosine = dot(point.normal, sight);
      if (options_.isTwoSided)
        cosine = std::abs(cosine);
      if (cosine > 0 && cosine >= lowestCosine_ * norm(sight))
        facing.push_back(static_cast<std::int32_t>(view));
    }
    while (!facing.empty()) {
      order = mix(order);
      std::swap(facing[static_cast<std::size_t>(order % facing.size())], facing.back());
      const std::int32_t view = facing.back();
      const Vector3d& sensor = sensors_[static_cast<std::size_t>(view)];
      if (!options_.isOccluded || !surface_.isOccluded(bare, sensor)) {
        if (dot(point.normal, sensor - point.position) < 0)
          point.normal = -point.normal;
        return view;
      }
      facing.pop_back();
    }
    return -1;
  }

private:
  const Surface& surface_;
  const std::vector<Vector3d>& sensors_;
  const SamplingOptions& options_;
  double lowestCosine_;
};

struct Candidate {
  enum class Fate : std::uint8_t { rejected, crowded, hidden, seen };
  Vector3d position, normal;
  std::int32_t view;
  Fate fate;
};

class Sampler {
public:
  Sampler(const Surface& surface, const std::vector<Vector3d>& sensors, const SamplingOptions& options,
          const Displacement* displacement, std::uint64_t seed, Execution& execution)
      : surface_(surface), isSeenByAll_(sensors.empty()), displacement_(displacement),
        visibility_(surface, sensors, options), random_(seed, 1), execution_(execution)
  {}

  /// The next batch of candidates; only those that keep the radius to the grid's points are looked at.
  const std::vector<Candidate>& draw(std::size_t count, const PointGrid* grid, double radius)
  {
    draws_.resize(count);
    for (Draw& draw : draws_) {
      draw.part = random_.uniform();
      draw.u = random_.uniform();
      draw.v = random_.uniform();
      draw.accept = random_.uniform();
      draw.order = random_.bits();
    }
    candidates_.resize(count);
    execution_.forRange(static_cast<std::int64_t>(count), 1024, [&](std::int64_t begin, std::int64_t end) {
      for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
        candidates_[i] = evaluate(draws_[i], grid, radius);
    });
    return candidates_;
  }

private:
  Candidate evaluate(const Draw& draw, const PointGrid* grid, double radius) const
  {
    using Fate = Candidate::Fate;
    Candidate candidate{Vector3d::Zero(), Vector3d::Zero(), -1, Fate::rejected};
    SurfacePoint point;
    if (!surface_.sample(draw, point))
      return candidate;
    SurfacePoint moved = point;
    if (displacement_ && !displacement_->apply(moved))
      return candidate;
    if (grid && grid->hasWithin(moved.position, moved.normal, radius)) {
      candidate.fate = Fate::crowded;
      return candidate;
    }
    candidate.view = isSeenByAll_ ? 0 : visibility_.choose(point, moved, draw.order);
    candidate.fate = candidate.view < 0 ? Fate::hidden : Fate::seen;
    candidate.position = moved.position;
    candidate.normal = moved.normal;
    return candidate;
  }

  const Surface& surface_;
  bool isSeenByAll_;
  const Displacement* displacement_;
  Visibility visibility_;
  Random random_;
  Execution& execution_;
  std::vector<Draw> draws_;
  std::vector<Candidate> candidates_;
};

double estimateVisibleArea(Sampler& sampler, const Surface& surface)
{
  std::int64_t seen = 0, drawn = 0;
  const std::size_t batch = 1 << 14;
  while (seen < 4096 && drawn < (1 << 20)) {
    for (const Candidate& candidate : sampler.draw(batch, nullptr, 0))
      seen += candidate.fate == Candidate::Fate::seen ? 1 : 0;
    drawn += batch;
  }
  if (seen < 100)
    throw InvalidInput(
        "less than .01 % of the surface is seen by the sensors: is the mesh inside out, or are the sensors "
        "inside of the object?");
  return surface.drawnArea() * static_cast<double>(seen) / static_cast<double>(drawn);
}

double meanSpacing(const PointGrid& grid, Execution& execution)
{
  const auto count = static_cast<std::int64_t>(std::min<std::size_t>(grid.size(), 100000));
  std::vector<double> distances(static_cast<std::size_t>(count));
  execution.forRange(count, 1024, [&](std::int64_t begin, std::int64_t end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
      distances[i] = grid.nearestOther(i);
  });
  double sum = 0;
  std::int64_t finite = 0;
  for (const double distance : distances)
    if (std::isfinite(distance)) {
      sum += distance;
      ++finite;
    }
  return finite > 0 ? sum / static_cast<double>(finite) : 0;
}

void validateScanner(const std::vector<Vector3d>& sensors, const SamplingOptions& options,
                     const Displacement* displacement)
{
  require(!sensors.empty(), "a scanner needs sensors: give some, or sample evenly or at random");
  require(displacement == nullptr, "a scanner's rays do not see a displacement: sample evenly or at random");
  require(options.isOccluded,
          "a scanner's rays end at the first surface: sample evenly or at random to see through it");
  require(options.aspect >= .01 && options.aspect <= 100, "the scanner's aspect must be .01 to 100");
  require(options.lowestElevation >= -90 && options.highestElevation <= 90 &&
              options.lowestElevation < options.highestElevation,
          "the scanner's elevations must be -90 to 90 degrees, the lower one first");
  require(options.axis.allFinite() && norm(options.axis) > 0 && options.forward.allFinite(),
          "the scanner's axis must not be zero, and its front direction finite");
}

/// Mean distance to the closest other point. Where density varies, a grid of one cell size would take too long.
double meanSpacing(const std::vector<Vector3d>& points, const Box& box, Execution& execution)
{
  if (points.size() < 2)
    return 0;
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(points.size());
  for (const Vector3d& x : points)
    positions.push_back(((x - box.center()) / box.diagonal()).cast<float>());
  const auto search = makePointBins();
  search->setPoints(positions, execution);
  std::vector<double> distances(positions.size());
  search->forEachPosition(positions, 2, NeighborSearch::Answer::distances, execution, [&](const NeighborBatch& batch) {
    for (std::size_t i = 0; i < batch.size; ++i)
      distances[batch.positions[i]] = std::sqrt(batch.squaredDistances[2 * i + 1]);
  });
  return box.diagonal() * std::accumulate(distances.begin(), distances.end(), 0.) /
         static_cast<double>(distances.size());
}

Samples sampleWithScanner(const Surface& surface, const std::vector<Vector3d>& sensors, const SamplingOptions& options,
                          const Displacement* displacement, std::uint64_t seed, Execution& execution)
{
  validateScanner(sensors, options, displacement);
  Sampler sampler(surface, sensors, options, nullptr, seed, execution);
  Samples samples;
  samples.visibleArea = estimateVisibleArea(sampler, surface);
  samples.points = scanWithRays(surface, sensors, options, seed, execution);
  samples.spacing = meanSpacing(samples.points.positions, surface.boundingBox(), execution);
  return samples;
}

} // namespace

std::vector<Vector3d> placeSensors(const ViewOptions& options, const Box& object)
{
  require(options.count >= 0 && options.count <= 10000, "the number of views must be 0 to 10000");
  require(options.distance > 0 && options.distance < 1e6, "the sensors' distance must be positive, in diagonals");
  require(std::abs(options.elevation) <= 90, "the elevation must be -90 to 90 degrees");
  require(options.fan >= 0 && options.fan <= 360, "the fan must span 0 to 360 degrees");
  require(options.axis.allFinite() && norm(options.axis) > 0, "the axis must not be zero");
  require(options.forward.allFinite(), "the front direction must be finite");
  const Vector3d axis = portable::unit(options.axis), front = portable::unit(options.forward);
  const Vector3d across = front - dot(front, axis) * axis;
  require(norm(across) > 1e-6, "the front direction must not be parallel to the axis");
  const Vector3d x = portable::unit(across), y = portable::cross(axis, x);

  std::vector<Vector3d> sensors;
  const double goldenTurn = 2 / (3 + std::sqrt(5.0));
  const portable::SinCos elevation = portable::sinCos(options.elevation / 360);
  for (int i = 0; i < options.count; ++i) {
    double sine = elevation.sine, cosine = elevation.cosine, turn = 0;
    switch (options.placement) {
    case Placement::sphere:
      sine = 1 - (2 * i + 1.0) / options.count;
      cosine = std::sqrt(1 - sine * sine);
      turn = i * goldenTurn;
      break;
    case Placement::ring:
      turn = static_cast<double>(i) / options.count;
      break;
    case Placement::front:
      turn = options.count > 1 ? options.fan / 360 * (static_cast<double>(i) / (options.count - 1) - .5) : 0;
      break;
    }
    const portable::SinCos around = portable::sinCos(turn);
    const Vector3d direction = sine * axis + cosine * (around.cosine * x + around.sine * y);
    sensors.push_back(object.center() + options.distance * object.diagonal() * direction);
  }
  return sensors;
}

Samples sampleSurface(const Surface& surface, const std::vector<Vector3d>& sensors, const SamplingOptions& options,
                      const Displacement* displacement, std::uint64_t seed, Execution& execution)
{
  require(options.points >= 1 && options.points <= INT32_MAX, "the number of points must be 1 to 2147483647");
  require(options.grazingLimit > 0 && options.grazingLimit <= 90,
          "the grazing limit must be above 0 and at most 90 degrees");

  if (options.pattern == Pattern::scanner)
    return sampleWithScanner(surface, sensors, options, displacement, seed, execution);
  Sampler sampler(surface, sensors, options, displacement, seed, execution);
  Samples samples;
  samples.visibleArea = estimateVisibleArea(sampler, surface);
  const auto wanted = static_cast<std::size_t>(options.points);
  const double meanSide = std::sqrt(samples.visibleArea / static_cast<double>(wanted));
  // Random discs jam at .83 of this side; at .7 a candidate in about 30 still finds a place at the end.
  const bool isEven = options.pattern == Pattern::even;
  double radius = isEven ? .7 * meanSide : 0;
  PointGrid grid(1.4 * meanSide, wanted);
  Points& points = samples.points;
  points.positions.reserve(wanted);
  points.normals.reserve(wanted);

  const std::size_t batch = std::clamp<std::size_t>(wanted / 2, 1024, 1 << 18);
  while (points.size() < wanted) {
    const std::size_t before = points.size();
    for (const Candidate& candidate : sampler.draw(batch, isEven ? &grid : nullptr, radius)) {
      if (candidate.fate != Candidate::Fate::seen || points.size() == wanted)
        continue;
      // Candidates of one batch have not seen each other yet.
      if (isEven && grid.hasWithin(candidate.position, candidate.normal, radius))
        continue;
      grid.add(candidate.position, candidate.normal);
      points.positions.push_back(candidate.position);
      points.normals.push_back(candidate.normal);
      if (!sensors.empty())
        points.views.push_back(candidate.view);
    }
    const double visibleDraws = static_cast<double>(batch) * samples.visibleArea / surface.drawnArea();
    if (static_cast<double>(points.size() - before) < .01 * visibleDraws)
      radius *= .95;
    execution.progress(static_cast<double>(points.size()) / static_cast<double>(wanted));
  }
  samples.spacing = meanSpacing(grid, execution);
  return samples;
}

} // namespace scan
} // namespace mrf
} // namespace pcl

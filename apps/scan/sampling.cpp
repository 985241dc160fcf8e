// SPDX-License-Identifier: BSD-3-Clause
#include "sampling.h"

#include "error_model.h"
#include "random.h"

#include <base/cell_hash.h>
#include <base/loops.h>
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/neighbor_search.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace pcl::mrf::scan {

using Eigen::Vector3d;

void Points::append(const Points& other, std::size_t i)
{
  positions.push_back(other.positions[i]);
  if (!other.normals.empty())
    normals.push_back(other.normals[i]);
  if (!other.views.empty())
    views.push_back(other.views[i]);
}

namespace {

/// Points in cubic cells.
class PointGrid {
public:
  PointGrid(const Vector3d& origin, double side) : origin_(origin), cells_(Vector3d::Zero(), side) {}

  void add(const Vector3d& position, const Vector3d& normal)
  {
    const std::uint32_t cell = cells_.add(cellOf(position));
    points_.resize(cells_.size());
    points_[cell].emplace_back(position, normal);
  }

  /// True if a point is closer than radius and faces the same side as the normal: points on the two sides of a thin
  /// plate do not count as neighbors.
  bool hasWithin(const Vector3d& position, const Vector3d& normal, double radius) const
  {
    const CellHash::Cell lower = cellOf(position - Vector3d::Constant(radius)),
                         upper = cellOf(position + Vector3d::Constant(radius));
    for (std::int64_t z = lower.z(); z <= upper.z(); ++z)
      for (std::int64_t y = lower.y(); y <= upper.y(); ++y)
        for (std::int64_t x = lower.x(); x <= upper.x(); ++x)
          if (const std::uint32_t cell = cells_.find({x, y, z}); cell != CellHash::none)
            for (const auto& [place, itsNormal] : points_[cell])
              if ((place - position).squaredNorm() < radius * radius && itsNormal.dot(normal) > 0)
                return true;
    return false;
  }

private:
  CellHash::Cell cellOf(const Vector3d& position) const { return cells_.cellOf((position - origin_).cast<float>()); }

  Vector3d origin_;
  CellHash cells_;
  std::vector<std::vector<std::pair<Vector3d, Vector3d>>> points_; ///< positions and normals, by cell
};

struct Candidate {
  Vector3d position, normal;
  std::int32_t view; ///< a sensor that sees it; −1: none, or it is too close to others or not on the surface
};

/// Draws candidates, batch by batch.
class Sampler {
public:
  Sampler(const Surface& surface, const std::vector<Vector3d>& sensors, const SamplingOptions& options,
          std::uint64_t seed, Execution& execution)
      : surface_(surface), sensors_(sensors), lowestCosine_(sinCos(options.grazingLimit / 360).cosine),
        random_(seed, 1), execution_(execution)
  {}

  /// The next batch of candidates; those closer than the radius to a point of the grid are rejected.
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
    forEach(execution_, static_cast<std::int64_t>(count), 1024,
            [&](std::size_t i) { candidates_[i] = evaluate(draws_[i], grid, radius); });
    return candidates_;
  }

private:
  Candidate evaluate(const Draw& draw, const PointGrid* grid, double radius) const
  {
    SurfacePoint point;
    if (!surface_.sample(draw, point) || (grid && grid->hasWithin(point.position, point.normal, radius)))
      return {point.position, point.normal, -1};
    const std::int32_t view = sensors_.empty() ? 0 : choose(point, draw.order);
    return {point.position, point.normal, view};
  }

  /// A random one of the sensors that see the point, -1 if none does.
  std::int32_t choose(const SurfacePoint& point, std::uint64_t order) const
  {
    std::vector<std::int32_t> facing;
    for (std::size_t view = 0; view < sensors_.size(); ++view) {
      const Vector3d sight = sensors_[view] - point.position;
      const double cosine = point.normal.dot(sight);
      if (cosine > 0 && cosine >= lowestCosine_ * sight.norm())
        facing.push_back(static_cast<std::int32_t>(view));
    }
    while (!facing.empty()) {
      order = mix(order);
      std::swap(facing[order % facing.size()], facing.back());
      const std::int32_t view = facing.back();
      if (!surface_.isOccluded(point, sensors_[view]))
        return view;
      facing.pop_back();
    }
    return -1;
  }

  const Surface& surface_;
  const std::vector<Vector3d>& sensors_;
  double lowestCosine_;
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
      seen += candidate.view >= 0 ? 1 : 0;
    drawn += batch;
  }
  if (seen < 100)
    throw InvalidInput(
        "less than .01 % of the surface is seen by the sensors: is the mesh inside out, or are the sensors "
        "inside of the object?");
  return surface.drawnArea() * static_cast<double>(seen) / static_cast<double>(drawn);
}

void validateScanner(const std::vector<Vector3d>& sensors, const SamplingOptions& options)
{
  require(!sensors.empty(), "a scanner or camera needs sensors: give some, or sample evenly or at random");
  require(options.aspect >= .01 && options.aspect <= 100, "the scanner's aspect must be .01 to 100");
  require(options.lowestElevation >= -90 && options.highestElevation <= 90 &&
              options.lowestElevation < options.highestElevation,
          "the scanner's elevations must be -90 to 90 degrees, the lower one first");
  require(options.axis.norm() > 0 && options.forward.norm() > 0,
          "the scanner's axis and its front direction must not be zero");
}

/// Mean distance to the closest other point at another place, 0 if there is none.
double meanSpacing(const std::vector<Vector3d>& points, const Box& box, Execution& execution)
{
  std::vector<Eigen::Vector3f> positions;
  for (const Vector3d& x : points)
    positions.push_back(((x - box.center()) / box.diagonal().norm()).cast<float>());
  const auto search = makePointBins();
  search->setPoints(positions, execution);
  std::vector<double> distances(points.size());
  execution.forRange(static_cast<std::int64_t>(points.size()), 1024, [&](std::int64_t begin, std::int64_t end) {
    Neighbors found;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const int count = search->nearest(positions[i], 2, found);
      // The first one is the point itself, or one at the same place.
      const std::size_t other = found.indices[0] == static_cast<std::int32_t>(i) ? 1 : 0;
      distances[i] = count < 2 ? 0 : (points[found.indices[other]] - points[i]).norm();
    }
  });
  double sum = 0;
  std::int64_t apart = 0;
  for (const double distance : distances) {
    sum += distance;
    apart += distance > 0 ? 1 : 0;
  }
  return apart > 0 ? sum / static_cast<double>(apart) : 0;
}

/// Takes visible candidates until there are as many points as wanted.
Points samplePoints(Sampler& sampler, const Surface& surface, const SamplingOptions& options, double visibleArea,
                    Execution& execution)
{
  const auto wanted = static_cast<std::size_t>(options.points);
  const double meanSide = std::sqrt(visibleArea / static_cast<double>(wanted));
  // Random discs jam at .83 of this side; at .7 one candidate in about 30 still finds a place at the end.
  const bool isEven = options.pattern == Pattern::even;
  double radius = isEven ? .7 * meanSide : 0;
  PointGrid grid(surface.boundingBox().min(), 1.4 * meanSide);
  Points points;
  const std::size_t batch = std::clamp<std::size_t>(wanted / 2, 1024, 1 << 18);
  while (points.size() < wanted) {
    const std::size_t before = points.size();
    for (const Candidate& candidate : sampler.draw(batch, isEven ? &grid : nullptr, radius)) {
      if (candidate.view < 0 || points.size() == wanted)
        continue;
      if (isEven) {
        // Candidates of one batch have not been compared with each other yet.
        if (grid.hasWithin(candidate.position, candidate.normal, radius))
          continue;
        grid.add(candidate.position, candidate.normal);
      }
      points.positions.push_back(candidate.position);
      points.normals.push_back(candidate.normal);
      points.views.push_back(candidate.view);
    }
    if (static_cast<double>(points.size() - before) <
        .01 * static_cast<double>(batch) * visibleArea / surface.drawnArea())
      radius *= .95;
    execution.progress(static_cast<double>(points.size()) / static_cast<double>(wanted));
  }
  return points;
}

} // namespace

std::vector<Vector3d> placeSensors(const ViewOptions& options, const Box& object)
{
  require(options.distance > 0 && options.distance < 1e6, "the sensors' distance must be positive, in diagonals");
  require(std::abs(options.elevation) <= 90, "the elevation must be -90 to 90 degrees");
  require(options.fan >= 0 && options.fan <= 360, "the fan must span 0 to 360 degrees");
  require(options.axis.norm() > 0, "the axis must not be zero");
  const Vector3d axis = options.axis.normalized(), front = options.forward.normalized();
  const Vector3d across = front - front.dot(axis) * axis;
  require(across.norm() > 1e-6, "the front direction must not be parallel to the axis");
  const Vector3d x = across.normalized(), y = axis.cross(x);

  std::vector<Vector3d> sensors;
  const double goldenTurn = 2 / (3 + std::sqrt(5.0));
  const SinCos elevation = sinCos(options.elevation / 360);
  for (int i = 0; i < options.count; ++i) {
    double sine = elevation.sine, cosine = elevation.cosine, turn = 0;
    if (options.placement == Placement::sphere) {
      sine = 1 - (2 * i + 1.0) / options.count;
      cosine = std::sqrt(1 - sine * sine);
      turn = i * goldenTurn;
    } else if (options.placement == Placement::ring)
      turn = static_cast<double>(i) / options.count;
    else if (options.count > 1)
      turn = options.fan / 360 * (static_cast<double>(i) / (options.count - 1) - .5);
    const SinCos around = sinCos(turn);
    const Vector3d direction = sine * axis + cosine * (around.cosine * x + around.sine * y);
    sensors.push_back(object.center() + options.distance * object.diagonal().norm() * direction);
  }
  return sensors;
}

Samples sampleSurface(const Surface& surface, const std::vector<Vector3d>& sensors, const SamplingOptions& options,
                      std::uint64_t seed, Execution& execution)
{
  require(options.grazingLimit > 0 && options.grazingLimit <= 90,
          "the grazing limit must be above 0 and at most 90 degrees");
  const bool hasRays = options.pattern == Pattern::scanner || options.pattern == Pattern::camera;
  if (hasRays)
    validateScanner(sensors, options);
  Sampler sampler(surface, sensors, options, seed, execution);
  Samples samples;
  samples.visibleArea = estimateVisibleArea(sampler, surface);
  samples.points = hasRays ? scanWithRays(surface, sensors, options, seed, execution)
                           : samplePoints(sampler, surface, options, samples.visibleArea, execution);
  if (sensors.empty())
    samples.points.views.clear();
  samples.spacing = meanSpacing(samples.points.positions, surface.boundingBox(), execution);
  return samples;
}

} // namespace pcl::mrf::scan

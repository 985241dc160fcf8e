// SPDX-License-Identifier: BSD-3-Clause
// Properties that every surface must have with default settings: random scenes of known shape, seen from all sides or
// by several sensors, with holes and noise, are compared with the truth.
//   test_invariants [SCENES [FIRST_SEED]]
// A scene is named by its seed: SCENES = 1 runs it alone and prints the measures.
#include "base/select_values.h"
#include "support/clouds.h"
#include "support/meshes.h"
#include "support/random.h"
#include "support/scans.h"
#include "support/shapes.h"

#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/reconstruction.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

using namespace pcl::mrf;
using clouds::Random;
using Eigen::Vector3d;
using Eigen::Vector3f;

namespace {

constexpr double halfSide = 1.3, farthest = 12; // of the scenes, and of what sensors see

/// No part is thinner than three spacings: with noise, thinner parts would not give a surface.
shapes::Sdf drawPart(Random& random)
{
  const double size = random.uniform(.25, .6);
  const Vector3d center = .5 * random.inCube();
  switch (static_cast<int>(random.uniform(0, 4))) {
  case 0:
    return shapes::sphere(size, center);
  case 1:
    return shapes::translate(shapes::box({size, random.uniform(.2, .6), random.uniform(.2, .6)}, .08), center);
  case 2:
    return shapes::tube(center, .5 * random.inCube(), random.uniform(.2, .4));
  default:
    return shapes::translate(shapes::torus(size, random.uniform(.15, .25)), center);
  }
}

/// A scene and its scan.
struct Scene {
  shapes::Sdf truth;
  double spacing, noise = 0;
  PointSet seen;
  std::vector<Vector3d> sensors; ///< that saw it; empty: seen from all sides
  bool knowsSensors = false, knowsNormals = true;

  explicit Scene(std::uint64_t seed)
  {
    Random random(seed * 7919 + 15);
    std::vector<shapes::Sdf> parts;
    for (int left = static_cast<int>(random.uniform(1, 4)); left > 0; --left)
      parts.push_back(drawPart(random));
    truth = shapes::unite(parts);
    spacing = random.uniform(.05, .09);
    seen = shapes::sample(truth, halfSide, spacing, static_cast<unsigned>(seed));
    if (random.uniform(0, 2) < 1)
      for (int left = static_cast<int>(random.uniform(1, 4)); left > 0; --left)
        sensors.push_back(random.uniform(2, 6) * random.direction());
    if (!sensors.empty())
      keepWhatIsSeen();
    for (int left = static_cast<int>(random.uniform(0, 3)); left > 0 && seen.size() > 0; --left)
      cut(seen.positions[static_cast<std::size_t>(random.uniform(0, static_cast<double>(seen.size())))],
          random.uniform(2, 6) * spacing);
    if (random.uniform(0, 3) < 1) {
      noise = random.uniform(.1, .5) * spacing;
      shapes::addNoise(seen, noise, static_cast<unsigned>(seed));
    }
    knowsSensors = !sensors.empty() && random.uniform(0, 2) < 1;
    knowsNormals = random.uniform(0, 3) >= 1;
  }

  /// How far a ray comes before it meets the surface; longest if it does not.
  double trace(const Vector3d& from, const Vector3d& direction, double longest) const
  {
    double way = 0;
    while (way < longest) {
      const double distance = truth(from + way * direction);
      if (distance < 1e-4)
        return way;
      way += distance;
    }
    return longest;
  }

  RawCloud cloud() const
  {
    RawCloud result;
    result.positions = seen.positions;
    if (knowsNormals)
      result.normals = seen.normals;
    if (knowsSensors) {
      result.sensors = sensors;
      if (sensors.size() > 1)
        result.views = seen.views;
    }
    return result;
  }

private:
  /// Leaves the points that some sensor sees, at less than 75° to their normal, and notes which.
  void keepWhatIsSeen()
  {
    std::vector<std::int32_t> views(seen.size(), -1);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const Vector3d position = seen.positions[i].cast<double>(), normal = seen.normals[i].cast<double>();
      for (std::size_t s = 0; s < sensors.size() && views[i] < 0; ++s) {
        const Vector3d sight = sensors[s] - position;
        const double distance = sight.norm();
        if (normal.dot(sight) > .26 * distance &&
            trace(position + .01 * normal, sight / distance, distance) >= distance)
          views[i] = static_cast<std::int32_t>(s);
      }
    }
    seen.views = views;
    keep([&](std::size_t i) { return views[i] >= 0; });
  }

  void cut(const Vector3f& middle, double radius)
  {
    keep([&](std::size_t i) { return (seen.positions[i] - middle).norm() > static_cast<float>(radius); });
  }

  template <typename Wanted>
  void keep(const Wanted& wanted)
  {
    std::vector<std::uint8_t> flags(seen.size());
    for (std::size_t i = 0; i < flags.size(); ++i)
      flags[i] = wanted(i) ? 1 : 0;
    seen = select(seen, flags);
  }
};

/// The measures of a surface.
struct Measures {
  double farthestPoint = 0; ///< of the points that were used, to the mesh: in 3 spacings and 3 deviations
  double seenThrough = 0;   ///< share of the area before what the true sensors saw, by more than 5 spacings
  double beyondBox = 0;     ///< how far the mesh leaves the box around the points, in half of the largest hole
  double end = 0;           ///< median distance of the vertices of borders to the nearest point, in spacings
  std::int64_t intersecting = 0;
};

/// The share of the area that lies in front of surface that a sensor saw, apart from the margin of surface that points
/// support. Rays to the true surface decide, not the points; but the place that a ray meets must have been sampled.
double seenThroughShare(const Scene& scene, const Reconstruction& result, const NeighborSearch& search)
{
  const double sheet = 5 * scene.spacing + 3 * scene.noise, end = 3 * (scene.spacing + scene.noise);
  double through = 0, all = 0;
  Neighbors nearest;
  const auto distanceToPoint = [&](const Vector3d& place) {
    search.nearest(place.cast<float>(), 1, nearest);
    return std::sqrt(static_cast<double>(nearest.squaredDistances[0]));
  };
  for (const Triangle& t : result.mesh.triangles) {
    const Vector3f &a = result.mesh.vertices[t[0]], &b = result.mesh.vertices[t[1]], &c = result.mesh.vertices[t[2]];
    const double area = static_cast<double>((b - a).cross(c - a).norm()) / 2;
    const Vector3d middle = ((a + b + c) / 3).cast<double>();
    all += area;
    const auto sawThrough = [&](const Vector3d& sensor) {
      const Vector3d way = middle + result.points.offset - sensor, sight = way.normalized();
      const double met = scene.trace(sensor, sight, farthest);
      const Vector3d place = sensor + met * sight;
      return met < farthest && met > way.norm() + sheet && shapes::normalOf(scene.truth, place).dot(-sight) > .5 &&
             distanceToPoint(place - result.points.offset) < scene.spacing;
    };
    if (distanceToPoint(middle) > end && std::any_of(scene.sensors.begin(), scene.sensors.end(), sawThrough))
      through += area;
  }
  return all > 0 ? through / all : 0;
}

Measures measureAll(const Scene& scene, const Reconstruction& result)
{
  Measures measures;
  const OrientedPoints& points = result.points;
  const TriangleMesh& mesh = result.mesh;
  const std::unique_ptr<NeighborSearch> search = makeKdTree();
  search->setPoints(points.positions);
  std::vector<Vector3d> positions;
  for (const Vector3f& p : points.positions)
    positions.push_back(p.cast<double>());
  const std::vector<double> distances = distancesToMesh(positions, mesh);
  for (std::size_t i = 0; i < distances.size(); ++i)
    measures.farthestPoint = std::max(measures.farthestPoint,
                                      distances[i] / (3 * static_cast<double>(points.spacings[i]) + 3 * scene.noise));
  if (scene.knowsSensors)
    measures.seenThrough = seenThroughShare(scene, result, *search);

  Eigen::AlignedBox3f box;
  for (const Vector3f& p : points.positions)
    box.extend(p);
  float beyond = 0;
  for (const Vector3f& v : mesh.vertices)
    beyond = std::max(beyond, std::sqrt(box.squaredExteriorDistance(v)));
  measures.beyondBox =
      static_cast<double>(beyond) / (result.report.trimming.largestHole / 2 + 3 * scene.spacing + 3 * scene.noise);

  std::vector<double> ends;
  Neighbors nearest;
  for (const auto& edge : meshes::boundaryOf(mesh))
    if (search->nearest(mesh.vertices[edge.first], 1, nearest) > 0)
      ends.push_back(std::sqrt(static_cast<double>(nearest.squaredDistances[0])) / scene.spacing);
  if (!ends.empty())
    measures.end = median(ends);
  measures.intersecting = result.report.intersecting - result.report.intersectingBeforeRemeshing;
  return measures;
}

/// The first property that does not hold; empty if all hold. A rule that drops components reports that, and the surface
/// of their points is gone. The filling of a hole of a closed surface stays if less than half of it was seen through.
std::string faultOf(const Measures& found, const Report& report)
{
  std::string text;
  const auto require = [&](bool holds, const char* what, double value) {
    if (!holds)
      text += std::string(text.empty() ? "" : "; ") + what + " " + std::to_string(value);
  };
  require(found.farthestPoint <= 1 || report.trimming.componentsDropped > 0,
          "a point is off the surface by 3 spacings and deviations times", found.farthestPoint);
  require(found.seenThrough <= .01, "of the area, before what a sensor saw:", found.seenThrough);
  require(found.beyondBox <= 1, "beyond the points by half of the largest hole times", found.beyondBox);
  require(found.end <= 2.5, "borders end beyond the points by spacings:", found.end);
  require(found.intersecting <= 0,
          "triangles that intersect since remeshing:", static_cast<double>(found.intersecting));
  return text;
}

} // namespace

int main(int argc, char** argv)
{
  const std::uint64_t scenes = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 40;
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 0;
  if (argc > 3 || scenes == 0) {
    std::fprintf(stderr, "usage: test_invariants [SCENES [FIRST_SEED]]\n");
    return 2;
  }
  std::uint64_t failures = 0, meshes = 0;
  for (std::uint64_t seed = first; seed < first + scenes; ++seed) {
    const Scene scene(seed);
    if (scene.seen.size() < 200) // too little was seen
      continue;
    Execution execution(2);
    std::string fault;
    Measures found;
    try {
      const Reconstruction result = reconstruct(scene.cloud(), {}, execution);
      found = measureAll(scene, result);
      fault = faultOf(found, result.report);
    } catch (const std::exception& error) {
      fault = error.what();
    }
    ++meshes;
    failures += fault.empty() ? 0 : 1;
    if (!fault.empty() || scenes == 1)
      std::printf(
          "seed %llu, %zu points, %zu sensors%s, %s normals, noise of %.2f spacings: %s\n  farthest point %.2f, "
          "seen through %.4f, beyond the box %.2f, end %.2f\n",
          static_cast<unsigned long long>(seed), scene.seen.size(), scene.sensors.size(),
          scene.knowsSensors ? " (known)" : "", scene.knowsNormals ? "true" : "no", scene.noise / scene.spacing,
          fault.c_str(), found.farthestPoint, found.seenThrough, found.beyondBox, found.end);
  }
  std::printf("%llu scenes, %llu without what must hold\n", static_cast<unsigned long long>(meshes),
              static_cast<unsigned long long>(failures));
  return failures == 0 && meshes > 0 ? 0 : 1;
}

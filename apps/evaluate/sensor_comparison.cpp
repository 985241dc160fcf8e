// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation.h"

#include "local_spacing.h"
#include "scan/mesh_surface.h"
#include "surface_distance.h"

#include <base/loops.h>
#include <base/select_values.h>
#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace mrf_apps {
namespace {

using Eigen::Vector3d;
using pcl::mrf::Execution;

/// The first hits of rays on the triangles of a mesh that have an area.
class Rays {
public:
  explicit Rays(const SurfaceMesh& mesh) : mesh_(mesh), surface_(surfaceOf(mesh)) {}

  struct Hit {
    double range = 0;
    Vector3d normal = Vector3d::Zero(); ///< interpolated if the mesh has vertex normals, else the triangle's
  };

  /// \return false if the ray meets no triangle
  bool first(const Vector3d& origin, const Vector3d& direction, Hit& hit) const
  {
    pcl::mrf::scan::SurfacePoint point;
    if (!surface_.firstHit(origin, direction, point))
      return false;
    hit.range = (point.position - origin).norm();
    hit.normal = normalAt(point.part, point.position);
    return true;
  }

  /// The unit normal at a place of a triangle.
  Vector3d normalAt(std::size_t triangle, const Vector3d& x) const
  {
    const Vector3d area = areaVector(mesh_, triangle);
    Vector3d normal = Vector3d::Zero();
    for (std::size_t i = 0; i < 3 && !mesh_.normals.empty(); ++i) {
      const auto& t = mesh_.triangles[triangle];
      const Vector3d &b = mesh_.vertices[t[(i + 1) % 3]], &c = mesh_.vertices[t[(i + 2) % 3]];
      normal += std::max(0., (b - x).cross(c - x).dot(area)) * mesh_.normals[t[i]].cast<double>();
    }
    return normal.allFinite() && !normal.isZero(0) ? normal.normalized() : area.normalized();
  }

private:
  static pcl::mrf::scan::MeshSurface surfaceOf(const SurfaceMesh& mesh)
  {
    std::vector<Vector3d> vertices = mesh.vertices;
    auto triangles = mesh.triangles;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      if (areaVector(mesh, t).isZero(0))
        triangles[t].fill(triangles[t][0]); // no ray meets it then
    for (Vector3d& x : vertices)
      if (!x.allFinite())
        x.setZero(); // it is in no triangle with an area
    return {std::move(vertices), std::move(triangles)};
  }

  const SurfaceMesh& mesh_;
  pcl::mrf::scan::MeshSurface surface_;
};

/// The line from a sensor to a place. Depth is along the sensors' axis, or the line itself if they have none.
struct Sight {
  Vector3d direction;
  double range, depth;

  Sight(const Vector3d& sensor, const Vector3d& x, const Vector3d& axis)
      : direction((x - sensor).normalized()), range((x - sensor).norm()),
        depth(axis.isZero(0) ? range : axis.normalized().dot(x - sensor))
  {}
};

/// A sample of the reference as one sensor sees it.
struct Seen {
  double weight = 0; ///< pixels, or solid angle, that the sample fills; 0: it is hidden
  bool isHit = false;
  double error = 0, limit = 0; ///< in depth; the error is positive if the mesh is behind the reference
  bool isThere() const { return isHit && std::abs(error) <= limit; }
  bool isInFront() const { return isHit && error < -limit; }
};

/// Which places were scanned. \param measured points of the scanned surface; unknown spacings: all of it
std::vector<bool> areScanned(const std::vector<Vector3d>& places, const LocalSpacing& measured, Execution& execution)
{
  std::vector<bool> result(places.size(), true);
  if (!measured.isKnown())
    return result;
  const std::vector<LocalSpacing::Nearest> nearest = measured.nearest(places, execution);
  for (std::size_t i = 0; i < nearest.size(); ++i)
    result[i] = nearest[i].distance <= SensorComparison::scannedLimit * nearest[i].spacing;
  return result;
}

double limitAt(double depth, const EvaluationOptions& options)
{
  return options.farLimit + options.farGrowth * depth * depth;
}

struct Comparison {
  const SurfaceMesh &mesh, &reference;
  const EvaluationOptions& options;
  Execution& execution;
  LocalSpacing scanned; ///< of the measured points
  Rays toMesh = Rays(mesh), toReference = Rays(reference);

  /// Compares the reference with the mesh as the sensors see them. \return the true area where the mesh is there
  double compareViews(SensorComparison& result) const
  {
    const std::size_t sensors = options.sensors.size();
    const SurfaceSamples truth = sampleSurface(reference, options.samples, options.seed);
    const std::vector<bool> isScanned = areScanned(truth.positions, scanned, execution);
    std::vector<Seen> seen(truth.positions.size() * sensors);
    std::vector<double> areas(truth.positions.size()); ///< of samples, by interpolated normals, over the triangles'
    pcl::mrf::forEach(execution, options.samples, 256, [&](std::size_t i) {
      for (std::size_t s = 0; s < sensors; ++s) {
        const Vector3d &sensor = options.sensors[s], &x = truth.positions[i];
        const auto triangle = static_cast<std::size_t>(truth.triangles[i]);
        const Sight sight(sensor, x, options.sensorAxis);
        Rays::Hit hit;
        if (!isScanned[i] || !(sight.depth > 0) || !toReference.first(sensor, sight.direction, hit) ||
            hit.range < (1 - 1e-6) * sight.range)
          continue;
        Seen& one = seen[i * sensors + s];
        const double across = std::abs(areaVector(reference, triangle).normalized().dot(sight.direction));
        one.weight = across * sight.range / std::pow(sight.depth, 3);
        areas[i] = across / std::max(.05, std::abs(toReference.normalAt(triangle, x).dot(sight.direction)));
        one.limit = limitAt(sight.depth, options);
        one.isHit = toMesh.first(sensor, sight.direction, hit);
        one.error = (hit.range - sight.range) * sight.depth / sight.range;
      }
    });

    double all = 0, there = 0, front = 0, squares = 0, inLimits = 0, trueArea = 0;
    for (std::size_t i = 0; i < areas.size(); ++i) {
      bool isThere = false;
      for (std::size_t s = 0; s < sensors; ++s) {
        const Seen& one = seen[i * sensors + s];
        all += one.weight;
        front += one.isInFront() ? one.weight : 0;
        if (!one.isThere() || one.weight == 0)
          continue;
        isThere = true;
        there += one.weight;
        squares += one.weight * one.error * one.error;
        inLimits += one.weight * std::pow(one.error / one.limit, 2);
      }
      trueArea += isThere ? areas[i] : 0;
    }
    if (!(all > 0))
      throw pcl::mrf::InvalidInput("the sensors see nothing of the reference");
    result.inFrontShare = front / all;
    result.missingShare = 1 - (front + there) / all;
    result.rms = there > 0 ? std::sqrt(squares / there) : 0;
    result.rmsPercent = 100 / options.diagonal * result.rms;
    result.rmsInLimits = there > 0 ? std::sqrt(inLimits / there) : 0;
    return trueArea / static_cast<double>(areas.size()) * surfaceArea(reference);
  }

  /// Compares the samples of the mesh with the reference. \param trueArea as compareViews returns it
  void compareSurface(double trueArea, SensorComparison& result) const
  {
    const std::size_t sensors = options.sensors.size();
    const SurfaceSamples made = sampleSurface(mesh, options.samples, options.seed);
    // Samples of the mesh stand for the same area each. Behind the visible surface nothing is known.
    std::vector<Rays::Hit> hits(made.positions.size() * sensors);
    std::vector<Vector3d> hitPlaces(hits.size());
    pcl::mrf::forEach(execution, options.samples, 256, [&](std::size_t i) {
      for (std::size_t s = 0; s < sensors; ++s) {
        const Sight sight(options.sensors[s], made.positions[i], options.sensorAxis);
        if (sight.depth > 0)
          toReference.first(options.sensors[s], sight.direction, hits[i * sensors + s]);
        hitPlaces[i * sensors + s] = options.sensors[s] + hits[i * sensors + s].range * sight.direction;
      }
    });
    const std::vector<bool> isHitScanned = areScanned(hitPlaces, scanned, execution);
    enum class Place { unknown, inFront, measured };
    std::vector<double> measured; // angles
    double before = 0, flipped = 0;
    for (std::size_t i = 0; i < made.positions.size(); ++i) {
      Place place = Place::unknown;
      for (std::size_t s = 0; s < sensors && place != Place::measured; ++s) {
        const Rays::Hit& hit = hits[i * sensors + s];
        if (hit.range == 0 || !isHitScanned[i * sensors + s])
          continue;
        const Sight sight(options.sensors[s], made.positions[i], options.sensorAxis);
        const double depth = hit.range * sight.depth / sight.range, limit = limitAt(depth, options);
        if (sight.depth < depth - limit)
          place = Place::inFront;
        if (std::abs(sight.depth - depth) > limit)
          continue;
        place = Place::measured;
        const Vector3d face = areaVector(mesh, made.triangles[i]);
        measured.push_back(std::atan2(face.cross(hit.normal).norm(), face.dot(hit.normal)) * 180 / M_PI);
        flipped += measured.back() > 90 ? 1 : 0;
      }
      before += place == Place::inFront ? 1 : 0;
    }
    const auto count = static_cast<double>(made.positions.size());
    result.inFrontAreaShare = before / count;
    if (measured.empty())
      return;
    result.medianNormalError = pcl::mrf::median(measured);
    result.flippedShare = flipped / static_cast<double>(measured.size());
    if (trueArea > 0)
      result.areaRatio = static_cast<double>(measured.size()) / count * surfaceArea(mesh) / trueArea;
  }
};

} // namespace

SensorComparison compareFromSensors(const SurfaceMesh& mesh, const SurfaceMesh& reference,
                                    const std::vector<Vector3d>& measured, const EvaluationOptions& options,
                                    Execution& execution)
{
  const Comparison comparison{mesh, reference, options, execution, LocalSpacing(measured, execution)};
  SensorComparison result;
  comparison.compareSurface(comparison.compareViews(result), result);
  return result;
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation.h"

#include "exact/self_intersections.h"
#include "local_spacing.h"
#include "support/float_offset.h"
#include "support/poly_data.h"
#include "surface_distance.h"

#include <base/loops.h>
#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>

#include <vtkNew.h>
#include <vtkStaticPointLocator.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace mrf_apps {

using pcl::mrf::Execution;
using pcl::mrf::InvalidInput;
using Points = std::vector<Eigen::Vector3d>;

namespace {

double diagonalOf(const Points& points)
{
  const Eigen::AlignedBox3d box = boxOf(points);
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

/// The vertices of the triangles with an area.
Points usedVertices(const SurfaceMesh& mesh)
{
  std::vector<bool> used(mesh.vertices.size(), false);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!areaVector(mesh, t).isZero(0))
      for (const std::int32_t v : mesh.triangles[t])
        used[v] = true;
  Points result;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v])
      result.push_back(mesh.vertices[v]);
  return result;
}

void resolve(const SurfaceMesh& mesh, const EvaluationInput& input, Evaluation& evaluation)
{
  EvaluationOptions& options = evaluation.options;
  if (options.diagonal == 0) {
    const bool isOfCloud = !input.reference && !input.cloud.empty();
    evaluation.diagonalSource = isOfCloud ? "input cloud" : input.reference ? "reference" : "mesh";
    const SurfaceMesh& surface = input.reference ? *input.reference : mesh;
    options.diagonal = isOfCloud ? diagonalOf(input.cloud) : diagonalOf(usedVertices(surface));
    if (!(options.diagonal > 0))
      throw InvalidInput("the bounding box has no extent; give the diagonal");
  }
  if (options.farLimit == 0)
    options.farLimit = .01 * options.diagonal;
}

/// The finite points of a cloud, and the closest place of the mesh to each.
struct MeasuredPoints {
  Points points;
  std::vector<ClosestPlace> places;
};

/// A quantile of sorted values, interpolated linearly.
double quantile(const std::vector<double>& values, double share)
{
  const double position = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (position - static_cast<double>(below)) * (values[above] - values[below]);
}

double shareAbove(const std::vector<double>& values, double limit)
{
  const auto above = std::count_if(values.begin(), values.end(), [&](double value) { return value > limit; });
  return values.empty() ? 0 : static_cast<double>(above) / static_cast<double>(values.size());
}

double largest(const std::vector<double>& values)
{
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

/// In degrees. The arc cosine would be inaccurate near 0 and 180.
double angleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b)
{
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / M_PI;
}

ReferenceComparison compare(const SurfaceMesh& mesh, const SurfaceDistance& toMesh, const SurfaceMesh& reference,
                            const EvaluationOptions& options, Execution& execution)
{
  const SurfaceDistance toReference(reference);
  ReferenceComparison result;

  const SurfaceSamples onMesh = sampleSurface(mesh, options.samples, options.seed);
  const std::vector<ClosestPlace> places = toReference.closest(onMesh.positions, execution);
  std::vector<double> distances = distancesOf(places), angles;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (places[i].distance <= options.farLimit)
      angles.push_back(angleBetween(areaVector(mesh, onMesh.triangles[i]), areaVector(reference, places[i].triangle)));
  result.inventedShare = shareAbove(distances, options.farLimit);
  result.flippedShare = shareAbove(angles, 90);
  result.normalDeviation = summarize(std::move(angles));
  result.meshToReference = summarize(std::move(distances));

  distances = distancesOf(toMesh.closest(sampleSurface(reference, options.samples, options.seed).positions, execution));
  result.missingShare = shareAbove(distances, options.farLimit);
  result.referenceToMesh = summarize(std::move(distances));
  if (result.missingShare < 1)
    result.areaRatio =
        (1 - result.inventedShare) * surfaceArea(mesh) / (1 - result.missingShare) / surfaceArea(reference);

  result.hausdorff = std::max({result.meshToReference.max, result.referenceToMesh.max,
                               largest(distancesOf(toReference.closest(usedVertices(mesh), execution))),
                               largest(distancesOf(toMesh.closest(usedVertices(reference), execution)))});
  result.hausdorffPercent = 100 / options.diagonal * result.hausdorff;
  return result;
}

/// The share of the cloud's normals that oppose the closest triangle's; zero and non-finite normals are skipped.
std::optional<double> flippedShare(const SurfaceMesh& mesh, const EvaluationInput& input,
                                   const std::vector<ClosestPlace>& places)
{
  if (input.cloudNormals.empty())
    return std::nullopt;
  std::int64_t normals = 0, flipped = 0;
  std::size_t measured = 0;
  for (std::size_t i = 0; i < input.cloud.size(); ++i) {
    if (!input.cloud[i].allFinite())
      continue;
    const Eigen::Vector3d face = areaVector(mesh, places[measured++].triangle);
    const Eigen::Vector3d normal = input.cloudNormals[i].cast<double>();
    if (!normal.allFinite() || normal.isZero(0))
      continue;
    ++normals;
    flipped += normal.dot(face) < 0 ? 1 : 0;
  }
  return normals > 0 ? std::optional<double>(static_cast<double>(flipped) / static_cast<double>(normals))
                     : std::nullopt;
}

/// \param evaluation so far
std::optional<LocalComparison> compareLocally(const SurfaceMesh& mesh, const EvaluationInput& input,
                                              const MeasuredPoints& cloud, const Evaluation& evaluation,
                                              Execution& execution)
{
  const LocalSpacing local(cloud.points, execution);
  if (!local.isKnown())
    return std::nullopt;
  LocalComparison result;
  std::vector<double> spacings, inSpacings;
  for (const LocalSpacing::Nearest& point : local.nearest(cloud.points, execution)) {
    inSpacings.push_back(cloud.places[spacings.size()].distance / point.spacing);
    spacings.push_back(point.spacing);
  }
  std::sort(spacings.begin(), spacings.end());
  result.spacing = quantile(spacings, .5);
  result.unevenness = quantile(spacings, .9) / quantile(spacings, .1);
  result.cloudRms = evaluation.cloud->rms / result.spacing;
  if (evaluation.heldOut)
    result.heldOutRms = evaluation.heldOut->rms / result.spacing;
  result.flippedShare = flippedShare(mesh, input, cloud.places);
  result.nearShare = 1 - shareAbove(inSpacings, LocalComparison::nearLimit);
  inSpacings.clear();
  const SurfaceSamples samples = sampleSurface(mesh, evaluation.options.samples, evaluation.options.seed);
  for (const LocalSpacing::Nearest& nearest : local.nearest(samples.positions, execution))
    inSpacings.push_back(nearest.distance / nearest.spacing);
  result.inventedShare = shareAbove(inSpacings, LocalComparison::inventedLimit);
  return result;
}

void check(const SurfaceMesh& mesh, Evaluation& evaluation)
{
  // The library's checks take single precision: vertices that were floats in a file stay the same numbers; survey
  // coordinates are moved to the origin.
  const Eigen::Vector3d offset = mesh.doublePrecision ? floatOffset(mesh.vertices) : Eigen::Vector3d::Zero();
  pcl::mrf::TriangleMesh plain;
  plain.vertices = toFloat(mesh.vertices, offset);
  plain.triangles = mesh.triangles;
  evaluation.mesh = pcl::mrf::measure(plain);
  const double meanArea = evaluation.mesh.area / static_cast<double>(evaluation.mesh.triangles);
  const auto last = static_cast<double>(evaluation.areas.size() - 1);
  for (std::size_t t = 0; t < plain.triangles.size(); ++t) {
    const double bin = areaVector(mesh, t).norm() / meanArea / Evaluation::areaStep;
    ++evaluation.areas[static_cast<std::size_t>(std::fmin(std::fmax(bin, 0), last))]; // bin 0 for NaN
  }
  evaluation.selfIntersectingTriangles = static_cast<std::int64_t>(exact::selfIntersectingTriangles(plain).size() -
                                                                   exact::degenerateTriangles(plain).size());
}

} // namespace

Points finite(const Points& points)
{
  Points result;
  result.reserve(points.size());
  std::copy_if(points.begin(), points.end(), std::back_inserter(result),
               [](const Eigen::Vector3d& point) { return point.allFinite(); });
  return result;
}

Statistics summarize(std::vector<double> values)
{
  Statistics result;
  result.count = static_cast<std::int64_t>(values.size());
  if (values.empty())
    return result;
  std::sort(values.begin(), values.end());
  double sum = 0, squares = 0;
  for (const double value : values) {
    sum += value;
    squares += value * value;
  }
  result.mean = sum / static_cast<double>(values.size());
  result.rms = std::sqrt(squares / static_cast<double>(values.size()));
  result.median = quantile(values, .5);
  result.percentile95 = quantile(values, .95);
  result.max = values.back();
  return result;
}

Evaluation evaluate(const SurfaceMesh& mesh, const EvaluationInput& input, const EvaluationOptions& options,
                    Execution& execution)
{
  Evaluation result;
  result.options = options;
  const SurfaceDistance toMesh(mesh);
  resolve(mesh, input, result);
  const auto measurePoints = [&](const Points& points, std::optional<Statistics>& statistics) {
    MeasuredPoints measured{finite(points), {}};
    result.pointsNotFinite += static_cast<std::int64_t>(points.size() - measured.points.size());
    measured.places = toMesh.closest(measured.points, execution);
    if (!points.empty())
      statistics = summarize(distancesOf(measured.places));
    return measured;
  };
  const MeasuredPoints cloud = measurePoints(input.cloud, result.cloud);
  measurePoints(input.heldOut, result.heldOut);
  measurePoints(input.clean, result.clean);
  if (result.cloud)
    result.local = compareLocally(mesh, input, cloud, result, execution);
  if (input.reference)
    result.reference = compare(mesh, toMesh, *input.reference, result.options, execution);
  if (input.reference && !options.sensors.empty())
    result.sensor = compareFromSensors(mesh, *input.reference, finite(input.clean), result.options, execution);
  check(mesh, result);
  return result;
}

std::vector<float> vertexErrors(const SurfaceMesh& mesh, const EvaluationInput& input, Execution& execution)
{
  std::vector<float> errors(mesh.vertices.size(), std::numeric_limits<float>::quiet_NaN());
  if (input.reference) {
    const std::vector<ClosestPlace> places =
        SurfaceDistance(*input.reference).closest(finite(mesh.vertices), execution);
    for (std::size_t v = 0, i = 0; v < errors.size(); ++v)
      if (mesh.vertices[v].allFinite())
        errors[v] = static_cast<float>(places[i++].distance);
    return errors;
  }

  SurfaceMesh points;
  points.doublePrecision = true;
  Points& known = points.vertices = finite(input.clean.empty() ? input.cloud : input.clean);
  const Points heldOut = finite(input.heldOut);
  known.insert(known.end(), heldOut.begin(), heldOut.end());
  if (known.empty())
    throw InvalidInput("there is neither a reference nor a point that the mesh could be compared with");
  const auto data = toPolyData(points);
  vtkNew<vtkStaticPointLocator> locator;
  locator->SetDataSet(data);
  locator->BuildLocator();
  pcl::mrf::forEach(execution, static_cast<std::int64_t>(errors.size()), 1024, [&](std::size_t v) {
    const Eigen::Vector3d& vertex = mesh.vertices[v];
    if (vertex.allFinite())
      errors[v] = static_cast<float>((known[locator->FindClosestPoint(vertex.data())] - vertex).norm());
  });
  return errors;
}

} // namespace mrf_apps

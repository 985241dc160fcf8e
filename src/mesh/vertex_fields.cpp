// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/vertex_fields.h"

#include "options/confidence.h"

#include "base/loops.h"
#include "base/select_values.h"
#include "mesh/mesh_topology.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace pcl::mrf {
namespace {

constexpr std::int64_t fieldGrain = 1024;

/// Area-weighted mean normals of the triangles around each vertex, not normalized.
std::vector<Eigen::Vector3d> triangleNormals(const TriangleMesh& mesh)
{
  std::vector<Eigen::Vector3d> normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const Triangle& t : mesh.triangles) {
    const Eigen::Vector3d normal = TriangleCorners(mesh, t).cross();
    for (const std::int32_t v : t)
      normals[v] += normal;
  }
  return normals;
}

Rgb between(const std::array<float, 3>& first, const std::array<float, 3>& second, float share)
{
  Rgb color;
  for (std::size_t c = 0; c < 3; ++c)
    color[c] = static_cast<std::uint8_t>(std::lround(first[c] + share * (second[c] - first[c])));
  return color;
}

} // namespace

void setNormals(TriangleMesh& mesh, const DistanceField& field, Execution& execution)
{
  // A distance field's gradient has a length near 1 whatever the cloud's unit.
  constexpr float vanishing = 1e-6f;
  mesh.normals.assign(mesh.vertices.size(), Eigen::Vector3f::Zero());
  forEach(execution, mesh.vertices.size(), fieldGrain, [&](std::size_t v) {
    const Eigen::Vector3f gradient = field.sampleGradient(mesh.vertices[v]);
    const float length = gradient.norm();
    if (length > vanishing && std::isfinite(length))
      mesh.normals[v] = gradient / length;
  });
  const auto isZero = [](const Eigen::Vector3f& normal) { return normal.isZero(0); };
  if (std::none_of(mesh.normals.begin(), mesh.normals.end(), isZero))
    return;
  const std::vector<Eigen::Vector3d> substitutes = triangleNormals(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!isZero(mesh.normals[v]))
      continue;
    const double length = substitutes[v].norm();
    mesh.normals[v] = length > 0 ? Eigen::Vector3f((substitutes[v] / length).cast<float>()) : Eigen::Vector3f::UnitZ();
  }
}

Support::Support(const OrientedPoints& points, const NeighborSearch& search, float maxDistance, float spacing)
    : points_(points), search_(search), maxDistance_(maxDistance), spacing_(points.spacings.empty() ? 0 : spacing),
      largestSparseness_(spacing_ > 0 ? *std::max_element(points.spacings.begin(), points.spacings.end()) / spacing_
                                      : 1)
{}

bool Support::isAmidEvenOnes(std::size_t point) const
{
  constexpr int asked = 13;
  // Ratios of the squared extents along the surface, and of that across it to the lesser one.
  constexpr float even = .4f, flat = .1f;
  Neighbors nearest;
  search_.nearest(points_.positions[point], asked, nearest);
  Eigen::Matrix3f moments = Eigen::Matrix3f::Zero();
  for (const auto other : nearest.indices) {
    const Eigen::Vector3f arm = points_.positions[other] - points_.positions[point];
    moments += arm * arm.transpose();
  }
  const Eigen::Vector3f extents =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f>(moments, Eigen::EigenvaluesOnly).eigenvalues();
  return extents[1] > even * extents[2] && extents[0] < flat * extents[1];
}

float Support::reach(std::size_t point) const
{
  const float sparse = spacing_ > 0 ? points_.spacings[point] / (atBorder * spacing_) : 1;
  const float bySpacing =
      maxDistance_ * (sparse > farthest && isAmidEvenOnes(point) ? sparse : std::clamp(sparse, 1.f, farthest));
  return std::max(bySpacing, std::min(perDeviation * points_.deviation(point), farthest * maxDistance_));
}

float Support::sparseness(const Eigen::Vector3f& position, Neighbors& scratch) const
{
  if (spacing_ <= 0 || search_.nearest(position, 1, scratch) < 1)
    return 1;
  return points_.spacings[scratch.indices[0]] / spacing_;
}

float Support::confidence(const Eigen::Vector3f& position, ConfidenceShape shape, Neighbors& scratch) const
{
  if (search_.nearest(position, 1, scratch) < 1)
    return 0;
  const std::size_t point = scratch.indices[0];
  return confidenceAt(std::sqrt(scratch.squaredDistances[0]) / reach(point), shape) * points_.confidence(point);
}

void setConfidences(TriangleMesh& mesh, const Support& support, ConfidenceShape shape, Execution& execution)
{
  mesh.confidences.assign(mesh.vertices.size(), 0);
  execution.forRange(mesh.vertices.size(), fieldGrain, [&](std::size_t begin, std::size_t end) {
    Neighbors nearest;
    // A search takes longest far from all points. There one search shows that the vertices nearby have no support, too.
    Eigen::Vector3f asked = Eigen::Vector3f::Zero();
    float freeAround = 0;
    for (std::size_t v = begin; v < end; ++v) {
      if ((mesh.vertices[v] - asked).norm() < freeAround)
        continue;
      mesh.confidences[v] = support.confidence(mesh.vertices[v], shape, nearest);
      asked = mesh.vertices[v];
      constexpr float rounding = .999f;
      freeAround = nearest.squaredDistances.empty()
                       ? 0
                       : rounding * std::sqrt(nearest.squaredDistances.front()) - support.farthestReach();
    }
  });
}

EdgeSizing edgeSizing(const TriangleMesh& mesh, const Support& support, Execution& execution)
{
  // A point at a rim seems 1.4 times as sparse as those in the middle.
  constexpr float sparse = 1.75f, full = 2.5f;
  if (support.largestSparseness() <= sparse)
    return {};
  EdgeSizing sizing(mesh.vertices.size(), 1);
  execution.forRange(sizing.size(), fieldGrain, [&](std::size_t begin, std::size_t end) {
    Neighbors nearest;
    for (std::size_t v = begin; v < end; ++v) {
      const float ratio = support.sparseness(mesh.vertices[v], nearest);
      sizing[v] = std::max(1.f, std::min(ratio, 1 + (ratio - sparse) * (full - 1) / (full - sparse)));
    }
  });
  return sizing;
}

std::vector<float> interpolateAttributes(const std::vector<Eigen::Vector3f>& vertices, const NeighborSearch& search,
                                         const AttributeReader& read, int channels, Execution& execution)
{
  const std::size_t stride = channels;
  std::vector<float> values(vertices.size() * stride, 0);
  execution.forRange(vertices.size(), fieldGrain, [&](std::size_t begin, std::size_t end) {
    Neighbors nearest;
    std::vector<double> sums(stride);
    std::vector<float> ofPoint(stride);
    for (std::size_t v = begin; v < end; ++v) {
      const int found = search.nearest(vertices[v], 4, nearest);
      if (found < 1)
        continue;
      // Weights are relative to the nearest point's, which cannot overflow for tiny distances.
      const double closest = nearest.squaredDistances.front();
      double weights = 0;
      std::fill(sums.begin(), sums.end(), 0.);
      for (std::size_t n = 0; n < static_cast<std::size_t>(found); ++n) {
        const double squared = nearest.squaredDistances[n];
        const double weight = n == 0 ? 1 : closest / squared;
        if (!(weight > 0))
          continue;
        weights += weight;
        read(static_cast<std::size_t>(nearest.indices[n]), ofPoint.data());
        for (std::size_t c = 0; c < stride; ++c)
          sums[c] += weight * ofPoint[c];
      }
      for (std::size_t c = 0; c < stride; ++c)
        values[v * stride + c] = static_cast<float>(sums[c] / weights);
    }
  });
  return values;
}

Rgb toRgb(const float* channels)
{
  Rgb color;
  for (std::size_t c = 0; c < color.size(); ++c)
    color[c] = static_cast<std::uint8_t>(std::min(std::max(channels[c] + .5f, 0.f), 255.f));
  return color;
}

float largestSigmaShown(std::vector<float> sigmas)
{
  const double shown = quantile(std::move(sigmas), .95);
  if (!(shown > 0))
    return 1;
  const double digit = std::pow(10., std::floor(std::log10(shown)) - 1);
  return static_cast<float>(std::ceil(shown / digit - 1e-6) * digit);
}

Rgb sigmaColor(float sigma, float largest)
{
  constexpr std::array<std::array<float, 3>, 5> steps{
      {{49, 84, 166}, {65, 152, 175}, {120, 190, 120}, {238, 208, 84}, {196, 55, 40}}};
  const float share =
      sigma < largest ? std::max(sigma, 0.f) / largest : 1; // NaN, which is unknown, gets the last color
  const float position = share * static_cast<float>(steps.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(position), steps.size() - 2);
  const float part = position - static_cast<float>(below);
  return between(steps[below], steps[below + 1], part);
}

Rgb confidenceColor(float confidence)
{
  constexpr std::array<float, 3> blue{58, 92, 190}, skin{232, 190, 165};
  const float share = confidence > 0 ? std::min(confidence, 1.f) : 0; // NaN is no confidence
  return between(blue, skin, share);
}

} // namespace pcl::mrf

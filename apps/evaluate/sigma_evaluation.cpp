// SPDX-License-Identifier: BSD-3-Clause
#include "sigma_evaluation.h"

#include "surface_distance.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mrf_apps {
namespace {

/// Quantiles of |x| for a standard normal x at SigmaStatistics::levels.
constexpr std::array<double, 3> quantiles{.67449, 1.28155, 1.95996};

SigmaStatistics statisticsOf(const std::vector<SigmaSample>& samples, bool areFillings, double diagonal)
{
  SigmaStatistics result;
  double weights = 0;
  std::vector<std::pair<double, double>> widths; // and weights
  for (const SigmaSample& sample : samples) {
    if (areFillings == (sample.confidence > 0))
      continue;
    ++result.count;
    weights += sample.weight;
    const double ratio = sample.error / sample.sigma;
    for (std::size_t level = 0; level < quantiles.size(); ++level)
      result.coverage[level] += ratio <= quantiles[level] ? sample.weight : 0;
    result.rmsError += sample.weight * sample.error * sample.error;
    result.negativeLogLikelihood +=
        sample.weight * (std::log(sample.sigma / diagonal) + ratio * ratio / 2 + std::log(2 * M_PI) / 2);
    widths.emplace_back(quantiles.back() * sample.sigma, sample.weight);
  }
  if (!(weights > 0))
    return {};
  for (double& share : result.coverage)
    share /= weights;
  result.rmsError = std::sqrt(result.rmsError / weights);
  result.negativeLogLikelihood /= weights;
  std::sort(widths.begin(), widths.end());
  double below = 0;
  for (const auto& [width, weight] : widths) {
    below += weight;
    result.medianHalfWidth = width;
    if (below >= weights / 2)
      break;
  }
  return result;
}

/// The integral of Sparsification: RMS errors of the places left, the largest predictions being left out first, over
/// the RMS error of all. \param predictions of the errors, up to any increasing function
double areaOfSparsification(const std::vector<SigmaSample>& samples, const std::vector<double>& predictions)
{
  std::vector<std::size_t> order(samples.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return predictions[a] < predictions[b]; });
  double total = 0;
  for (const SigmaSample& sample : samples)
    total += sample.weight;
  double weights = 0, squares = 0, area = 0;
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    // Places with the same prediction are left out together, evenly.
    double equalWeights = 0, equalSquares = 0;
    for (; end < order.size() && predictions[order[end]] == predictions[order[begin]]; ++end) {
      const SigmaSample& sample = samples[order[end]];
      equalWeights += sample.weight;
      equalSquares += sample.weight * sample.error * sample.error;
    }
    constexpr int steps = 16; // of integration, because the curve is not straight
    const int parts = end - begin > 1 ? steps : 1;
    for (int step = 1; step <= parts; ++step) {
      const double share = (step - .5) / parts;
      area +=
          equalWeights / parts / total * std::sqrt((squares + share * equalSquares) / (weights + share * equalWeights));
    }
    weights += equalWeights;
    squares += equalSquares;
  }
  return squares > 0 ? area / std::sqrt(squares / weights) : 0;
}

/// For each vertex a third of the area of the triangles around it.
std::vector<double> vertexAreas(const SurfaceMesh& mesh)
{
  std::vector<double> areas(mesh.vertices.size(), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double third = areaVector(mesh, t).norm() / 3;
    for (const std::int32_t v : mesh.triangles[t])
      areas[v] += std::isfinite(third) ? third : 0;
  }
  return areas;
}

/// The corner of a triangle that is nearest to a point.
std::size_t nearestCorner(const SurfaceMesh& mesh, std::int32_t triangle, const Eigen::Vector3d& point)
{
  const auto& corners = mesh.triangles[triangle];
  const auto distance = [&](std::int32_t v) { return (mesh.vertices[v] - point).squaredNorm(); };
  return static_cast<std::size_t>(*std::min_element(
      corners.begin(), corners.end(), [&](std::int32_t a, std::int32_t b) { return distance(a) < distance(b); }));
}

const std::vector<float>& fieldOf(const SurfaceMesh& mesh, const char* name)
{
  const auto found = mesh.scalars.find(name);
  if (found == mesh.scalars.end())
    throw pcl::mrf::InvalidInput(std::string("the mesh has no field `") + name +
                                 "`; pcl_mrf_reconstruction --uncertainty writes it into ply files");
  return found->second;
}

} // namespace

SigmaEvaluation evaluateSigma(const std::vector<SigmaSample>& samples, double diagonal)
{
  SigmaEvaluation result;
  std::vector<SigmaSample> known;
  for (const SigmaSample& sample : samples)
    if (std::isfinite(sample.error) && std::isfinite(sample.sigma) && sample.sigma > 0)
      known.push_back(sample);
  result.notKnown = static_cast<std::int64_t>(samples.size() - known.size());
  result.measured = statisticsOf(known, false, diagonal);
  result.fillings = statisticsOf(known, true, diagonal);
  const auto areaBy = [&](const auto& predicted) {
    std::vector<double> predictions;
    for (const SigmaSample& sample : known)
      predictions.push_back(predicted(sample));
    return areaOfSparsification(known, predictions);
  };
  const double best = areaBy([](const SigmaSample& sample) { return sample.error; });
  result.sparsification.sigma = areaBy([](const SigmaSample& sample) { return sample.sigma; }) - best;
  result.sparsification.confidence = areaBy([](const SigmaSample& sample) { return -sample.confidence; }) - best;
  return result;
}

std::vector<SigmaSample> sigmaSamples(const SurfaceMesh& mesh, const EvaluationInput& input, double heldOutNoise,
                                      pcl::mrf::Execution& execution)
{
  const std::vector<float>&sigmas = fieldOf(mesh, "sigma"), &confidences = fieldOf(mesh, "confidence");
  std::vector<SigmaSample> samples;
  const auto add = [&](std::size_t vertex, double error, double noise, double weight) {
    const auto sigma = static_cast<double>(sigmas[vertex]), confidence = static_cast<double>(confidences[vertex]);
    samples.push_back({error, noise > 0 ? std::hypot(sigma, noise) : sigma, confidence, weight});
  };
  if (input.reference) {
    const std::vector<double> areas = vertexAreas(mesh);
    const std::vector<float> errors = vertexErrors(mesh, input, execution);
    for (std::size_t v = 0; v < errors.size(); ++v)
      add(v, static_cast<double>(errors[v]), 0, areas[v]);
    return samples;
  }
  const auto addPoints = [&](const std::vector<Eigen::Vector3d>& points, double noise) {
    const std::vector<ClosestPlace> places = SurfaceDistance(mesh).closest(points, execution);
    for (std::size_t p = 0; p < points.size(); ++p)
      add(nearestCorner(mesh, places[p].triangle, points[p]), places[p].distance, noise, 1);
  };
  addPoints(finite(input.heldOut), heldOutNoise);
  addPoints(finite(input.clean), 0);
  if (samples.empty())
    throw pcl::mrf::InvalidInput("sigma is compared with a reference, or with held-out or noise-free points; there are "
                                 "none");
  return samples;
}

} // namespace mrf_apps

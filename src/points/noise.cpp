// SPDX-License-Identifier: BSD-3-Clause
#include "points/noise.h"

#include "base/loops.h"
#include "base/select_values.h"
#include "points/local_plane.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

namespace pcl::mrf {
namespace {

/// Numbers of points in the neighborhoods; each neighborhood is about 1.4 times as wide as the one before.
constexpr std::array<std::size_t, 6> neighborhoods = {12, 24, 48, 96, 192, 384};
/// Numbers of points at which noise is measured: first fewSamples, and maxSamples only if these show enough noise.
constexpr std::size_t fewSamples = 256, maxSamples = 2048;
constexpr std::size_t groupCount = 6;
/// Correlation lengths that are tried, in spacings. With the last one, residuals grow up to the widest neighborhoods.
constexpr std::array<double, 8> correlations = {1., 1.41, 2., 2.83, 4., 5.66, 8., 11.3};
constexpr int unknowns = 6; ///< coefficients of a quadric

/// Neighbors share noise if the nearest points show less than this part of σ. They show .85 to 1.1 of white noise and 0
/// to .76 of a depth camera's noise, except in a few groups.
constexpr double shared = .8;

/// Points lie on a line if (width / length)² is at most this. A disc has 1, points of one ring of a lidar nearly 0.
constexpr double onLine = .1;

/// Measurements at one point, in local spacings: radii of its neighborhoods, residuals of their quadrics (NaN: none).
struct Sample {
  double key = 0, spacing = 0, known = 0;
  std::array<double, neighborhoods.size()> radius, residual;
  double nearest = std::numeric_limits<double>::quiet_NaN(); ///< residual of the points closest along the plane
  double roundness = nearest;                                ///< (width / length)² of the widest neighborhood
};

/// Positions of the neighbors relative to the first one, in radii: height over the plane, then two coordinates in it.
Eigen::Matrix3Xd overPlane(const Eigen::Vector3d& normal, const std::vector<Eigen::Vector3f>& positions,
                           const int* neighbors, std::size_t count, double radius)
{
  const Eigen::Vector3d origin = positions[neighbors[0]].cast<double>(), along = normal.unitOrthogonal();
  Eigen::Matrix3d axes;
  axes << normal, along, normal.cross(along);
  Eigen::Matrix3Xd local(3, static_cast<Eigen::Index>(count));
  for (Eigen::Index n = 0; n < local.cols(); ++n)
    local.col(n) = axes.transpose() * (positions[neighbors[n]].cast<double>() - origin) / radius;
  return local;
}

/// Standard deviation of the points' heights from the fitted quadric, in the unit of `local`.
double quadricResidual(const Eigen::Matrix3Xd& local)
{
  const auto height = local.row(0).transpose();
  const auto u = local.row(1).transpose().array(), v = local.row(2).transpose().array();
  Eigen::Matrix<double, Eigen::Dynamic, unknowns> terms(local.cols(), unknowns);
  terms << Eigen::VectorXd::Ones(local.cols()), u, v, u * u, u * v, v * v;
  const Eigen::Matrix<double, unknowns, unknowns> normal = terms.transpose() * terms;
  const Eigen::VectorXd quadric = normal.ldlt().solve(terms.transpose() * height);
  return std::sqrt((height - terms * quadric).squaredNorm() / static_cast<double>(local.cols() - unknowns));
}

/// Residual of the points closest along the plane of all points. It shows white noise in full, however thick the layer
/// of points is. In a thick layer, the points closest in space have similar heights and would show less.
double nearestResidual(const Eigen::Matrix3Xd& local)
{
  std::vector<std::pair<double, Eigen::Index>> byDistance;
  for (Eigen::Index n = 0; n < local.cols(); ++n)
    byDistance.emplace_back(local.col(n).tail<2>().squaredNorm(), n);
  std::partial_sort(byDistance.begin(), byDistance.begin() + neighborhoods.front(), byDistance.end());
  const double radius = std::sqrt(byDistance[neighborhoods.front() - 1].first);
  Eigen::Matrix3Xd nearest(3, static_cast<Eigen::Index>(neighborhoods.front()));
  for (Eigen::Index n = 0; n < nearest.cols(); ++n)
    nearest.col(n) = local.col(byDistance[n].second) / radius;
  const Eigen::Matrix2Xd centered = nearest.bottomRows<2>().colwise() - nearest.bottomRows<2>().rowwise().mean();
  const Eigen::Matrix2d moments = centered * centered.transpose();
  // The eigenvalues λ ≤ Λ satisfy λ > t Λ if λ Λ (1 + t)² > t (λ + Λ)²: determinant and trace are enough.
  if (!(moments.determinant() * std::pow(1 + onLine, 2) > onLine * std::pow(moments.trace(), 2)))
    return std::numeric_limits<double>::quiet_NaN();
  return radius * quadricResidual(nearest);
}

/// Finds the nearest points. Unless there is exactly one sensor, points whose normals face away are left out: they may
/// lie on the other wall of a thin object, which is not noise.
void findAround(const OrientedPoints& points, const NeighborSearch& search, std::size_t point, Neighbors& found)
{
  const std::size_t wanted = neighborhoods.back();
  const bool mayFaceAway = points.sensors.size() != 1;
  search.nearest(points.positions[point], static_cast<int>(mayFaceAway ? 2 * wanted : wanted), found);
  std::size_t kept = 0;
  for (std::size_t n = 0; n < found.indices.size() && kept < wanted; ++n)
    if (!mayFaceAway || points.normals[point].dot(points.normals[found.indices[n]]) > 0) {
      found.indices[kept] = found.indices[n];
      found.squaredDistances[kept++] = found.squaredDistances[n];
    }
  found.indices.resize(kept);
  found.squaredDistances.resize(kept);
}

Sample measure(const OrientedPoints& points, const NeighborSearch& search, std::size_t point, Neighbors& found)
{
  Sample sample;
  sample.spacing = points.spacings[point];
  findAround(points, search, point, found);
  const std::size_t number = found.indices.size();
  for (std::size_t k = 0; k < neighborhoods.size(); ++k) {
    sample.radius[k] = sample.residual[k] = std::numeric_limits<double>::quiet_NaN();
    if (neighborhoods[k] > number)
      continue;
    const double radius = std::sqrt(found.squaredDistances[neighborhoods[k] - 1]), inSpacings = radius / sample.spacing;
    const Plane plane = fitPlane(points.positions, found.indices.data(), neighborhoods[k], points.positions[point]);
    sample.radius[k] = inSpacings;
    if (!(plane.secondToFirst > onLine))
      continue;
    const Eigen::Matrix3Xd local =
        overPlane(plane.normal, points.positions, found.indices.data(), neighborhoods[k], radius);
    sample.residual[k] = inSpacings * quadricResidual(local);
    if (k + 1 == neighborhoods.size()) {
      sample.nearest = inSpacings * nearestResidual(local);
      sample.roundness = plane.secondToFirst;
    }
  }
  return sample;
}

/// Quantile of the values that are not NaN; NaN if there are none.
double quantileOfNumbers(std::vector<double> values, double share)
{
  values.erase(std::remove_if(values.begin(), values.end(), [](double value) { return std::isnan(value); }),
               values.end());
  return values.empty() ? std::numeric_limits<double>::quiet_NaN() : quantile(std::move(values), share);
}

/// First quartile of quadricResidual for Gaussian noise of deviation 1: that of χ, by Wilson and Hilferty.
double quartileOfDeviation(std::size_t count)
{
  constexpr double quartile = -.6745; // of a Gaussian
  const double freedom = static_cast<double>(count - unknowns);
  return std::pow(1 - 2 / (9 * freedom) + quartile * std::sqrt(2 / (9 * freedom)), 1.5);
}

/// Fits σ, the correlation length c and the shape to the residuals of quadrics within several radii, all in spacings.
/// It compares logarithms, with a max misfit each, because a quantized range leaves no residual within small radii.
NoiseGroup fit(const std::vector<double>& radii, const std::vector<double>& residuals)
{
  constexpr double lowest = .02, maxMisfit = 1;
  constexpr int steps = 24;
  const double largest = *std::max_element(residuals.begin(), residuals.end());
  const auto power = [&](double first, double last, int step) {
    return largest * first * std::pow(last / first, step / (steps - 1.));
  };
  NoiseGroup best;
  double bestMisfit = std::numeric_limits<double>::infinity();
  for (const double correlation : correlations)
    for (int shapeStep = -1; shapeStep < steps; ++shapeStep)
      for (int noiseStep = 0; noiseStep < steps; ++noiseStep) {
        const double noise = power(lowest, 1.2, noiseStep), shape = shapeStep < 0 ? 0 : power(lowest, 2, shapeStep);
        double misfit = 0;
        for (std::size_t k = 0; k < radii.size(); ++k) {
          const double seen = 1 - std::exp(-std::pow(radii[k] / correlation, 2)),
                       expected = noise * noise * seen + shape * shape * std::pow(radii[k] / 10, 3),
                       observed = std::pow(std::max(residuals[k], lowest * largest + 1e-4), 2);
          misfit += std::min(std::pow(std::log(expected / observed), 2), maxMisfit);
        }
        if (misfit < bestMisfit) {
          bestMisfit = misfit;
          best.deviation = noise;
          best.correlation = correlation;
        }
      }
  return best;
}

/// \param samples of one group
NoiseGroup describe(const std::vector<Sample>& samples)
{
  const auto quantileOf = [&](const auto& value, double share) {
    std::vector<double> values;
    for (const Sample& sample : samples)
      values.push_back(value(sample));
    return quantileOfNumbers(std::move(values), share);
  };
  NoiseGroup group;
  std::vector<double> radii, residuals;
  for (std::size_t k = 1; k < neighborhoods.size(); ++k) {
    const double residual = quantileOf([k](const Sample& sample) { return sample.residual[k]; }, .25);
    if (std::isnan(residual))
      continue;
    radii.push_back(quantileOf([k](const Sample& sample) { return sample.radius[k]; }, .5));
    residuals.push_back(residual / quartileOfDeviation(neighborhoods[k]));
  }
  if (residuals.size() + 1 == neighborhoods.size())
    group = fit(radii, residuals);
  constexpr std::size_t wide = 4; // a neighborhood wider than the noise
  const double share = std::sqrt(static_cast<double>(EIGEN_PI) / static_cast<double>(neighborhoods[wide]));
  group.side = quantileOf([share](const Sample& sample) { return share * sample.radius[wide] * sample.spacing; }, .5);
  group.known = quantileOf([](const Sample& sample) { return sample.known; }, .5);
  group.key = quantileOf([](const Sample& sample) { return sample.key; }, .5);
  group.spacing = quantileOf([](const Sample& sample) { return sample.spacing; }, .5);
  group.deviation *= group.spacing;
  group.correlation *= group.spacing;
  const auto ofFewest = [&](const auto& value) {
    return quantileOf(value, .25) / quartileOfDeviation(neighborhoods.front()) * group.spacing;
  };
  const double alongPlane = ofFewest([](const Sample&sample) { return sample.nearest; }),
               inSpace = ofFewest([](const Sample&sample) { return sample.residual.front(); });
  // A quantized range leaves the points in sheets. Points closest along the plane are then of different sheets.
  constexpr double ofSheets = .1;
  const bool inSheets = inSpace < ofSheets * group.deviation;
  group.white = inSheets ? inSpace : std::isnan(alongPlane) ? group.deviation : std::min(alongPlane, group.deviation);
  // Residuals that grow up to the widest neighborhoods are relief, not shared noise, unless there are sheets. So are
  // those of neighborhoods that reach around a rod, which are longer than wide.
  constexpr double ofRods = .3;
  const bool isRelief = !inSheets && !(group.correlation < correlations.back() * group.spacing);
  if (isRelief || quantileOf([](const Sample& sample) { return sample.roundness; }, .5) < ofRods)
    group.deviation = group.white;
  // Points closest along the plane lie on a line within the rings of a lidar. Neighbors in different rings share no
  // noise: the differences between rings are shape.
  constexpr double onRings = .25;
  double measured = 0, ofRings = 0;
  for (const Sample& sample : samples)
    if (!std::isnan(sample.roundness)) {
      ++measured;
      ofRings += std::isnan(sample.nearest) ? 1 : 0;
    }
  if (ofRings > onRings * measured) {
    group.deviation = group.white;
    group.correlation = group.side = group.spacing;
  }
  return group;
}

/// The ℓ that a group's noise asks for, see src/method.md; the factor suits six depth frames.
double smoothingFor(const NoiseGroup& group)
{
  constexpr double factor = 1.75;
  const double a = group.side, over = std::max(group.correlation, a),
               deviation = group.known > 0 ? group.known : group.deviation;
  return factor * a * std::pow(deviation * over / (a * a), .25);
}

/// ℓ is proportional to this power of the deviation that points weigh by, for a prior of order 3.
constexpr double smoothingPower = .4;

/// Sets the σ that points weigh by as a power of the key: the median slope between two groups, and the median factor.
/// \param follows value of a group that is proportional to this power of its points' σ
void fitLaw(NoiseModel& model, double (*follows)(const NoiseGroup& group), double power)
{
  constexpr double steepest = 3; // max exponent; time of flight has 0 to 2, disparity 2; small parts show it less well
  constexpr double apart = 1.3;  // min ratio of two keys for a slope
  std::vector<double> slopes, factors;
  for (std::size_t a = 0; a < model.groups.size(); ++a)
    for (std::size_t b = a + 1; b < model.groups.size(); ++b)
      if (model.groups[b].key > apart * model.groups[a].key) {
        const double slope = std::log(follows(model.groups[b]) / follows(model.groups[a])) /
                             std::log(model.groups[b].key / model.groups[a].key) / power;
        if (std::isfinite(slope)) // not from a group without noise
          slopes.push_back(slope);
      }
  model.exponent = slopes.empty() ? 0 : std::clamp(quantile(slopes, .5), 0., steepest);
  for (const NoiseGroup& group : model.groups)
    factors.push_back(group.deviation * std::pow(model.medianKey / group.key, model.exponent));
  model.deviation = quantile(factors, .5);
}

/// The ℓ of the median point that is enough for all groups: weights make the ℓ of a group longer or shorter.
double smoothingForAll(const NoiseModel& model)
{
  double smoothing = 0;
  for (const NoiseGroup& group : model.groups) {
    const double ratio =
        group.known > 0 ? group.known / model.deviation : std::pow(group.key / model.medianKey, model.exponent);
    smoothing = std::max(smoothing, smoothingFor(group) / std::pow(ratio, smoothingPower));
  }
  return smoothing;
}

double keyOf(const NoiseModel& model, const OrientedPoints& points, std::size_t i)
{
  return static_cast<double>(model.isByRange ? (points.positions[i] - model.sensor).norm() : points.spacings[i]);
}

/// Share of the groups that must agree about the noise of the cloud.
constexpr double majority = 2. / 3;

/// The largest factor such that this share of the groups asks for it or more.
double lengtheningOf(const std::vector<NoiseGroup>& groups)
{
  std::vector<double> all;
  for (const NoiseGroup& group : groups)
    all.push_back(group.lengthening());
  return valueAt(std::move(all), static_cast<std::size_t>((1 - majority) * groupCount + .5));
}

/// Sets the model's groups and median key. \param maxAsked max number of points at which noise is measured
void measureGroups(const OrientedPoints& points, const NeighborSearch& search, double known, std::size_t maxAsked,
                   NoiseModel& model, Execution& execution)
{
  const std::size_t count = std::min(points.size(), maxAsked);
  std::vector<Sample> samples(count);
  execution.forRange(count, 64, [&](std::size_t begin, std::size_t end) {
    Neighbors found;
    for (std::size_t n = begin; n < end; ++n) {
      const std::size_t point = n * points.size() / count;
      samples[n] = measure(points, search, point, found);
      samples[n].key = keyOf(model, points, point);
      samples[n].known = points.deviations.empty() ? known : static_cast<double>(points.deviations[point]);
    }
  });
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) { return a.key < b.key; });
  model.medianKey = samples[count / 2].key;
  model.groups.clear();
  for (std::size_t g = 0; g < groupCount; ++g) {
    const auto at = [&](std::size_t n) {
      return samples.begin() + static_cast<std::ptrdiff_t>(n * count / groupCount);
    };
    model.groups.push_back(describe({at(g), at(g + 1)}));
  }
}

} // namespace

bool NoiseGroup::isNoticeable() const
{
  // In spacings, σ is .01 to .16 in scans of heads, .13 to .19 in a scan of a dragon, .2 to 2.9 of a depth camera.
  constexpr double noticeable = .4;
  return deviation > noticeable * spacing;
}

bool NoiseGroup::isCorrelated() const
{
  return isNoticeable() && white < shared * deviation;
}

bool NoiseGroup::isStrong() const
{
  constexpr double strong = .8;
  return deviation > strong * spacing;
}

double NoiseGroup::lengthening() const
{
  constexpr double weakest = .1; // in spacings; less noise is hardly worth it, and looks like shape
  constexpr double ofLines = .4; // share of σ; the nearest points of a lidar lie on one line and show nearly none
  const bool isShared = deviation > weakest * spacing && white < shared * deviation && white > ofLines * deviation;
  return isShared ? std::pow(std::max(correlation / spacing, 1.), .25) : 1;
}

double NoiseModel::deviationAt(const OrientedPoints& points, std::size_t i) const
{
  if (!points.deviations.empty())
    return static_cast<double>(points.deviations[i]);
  return exponent > 0 ? deviation * std::pow(keyOf(*this, points, i) / medianKey, exponent) : deviation;
}

NoiseModel estimateNoise(const OrientedPoints& points, const NeighborSearch& search, double known, Execution& execution)
{
  NoiseModel model;
  model.deviation = points.deviations.empty()
                        ? known
                        : quantile(std::vector<double>(points.deviations.begin(), points.deviations.end()), .5);
  if (points.size() < groupCount * neighborhoods.back() || points.spacings.empty())
    return model;
  model.isByRange = points.sensors.size() == 1;
  if (model.isByRange)
    model.sensor = points.sensors.front();

  const auto share = [&model](bool (NoiseGroup::*property)() const) {
    return static_cast<double>(std::count_if(model.groups.begin(), model.groups.end(), std::mem_fn(property))) /
           static_cast<double>(groupCount);
  };
  measureGroups(points, search, known, fewSamples, model, execution);
  // If few samples show no noise, more samples will not show it in most groups.
  if (share(&NoiseGroup::isNoticeable) < majority / 2 && lengtheningOf(model.groups) == 1)
    return model;
  measureGroups(points, search, known, maxSamples, model, execution);
  if (!(model.medianKey > 0))
    return model;
  constexpr std::size_t enough = 6000; // points; with fewer, shape within the widest neighborhoods looks like noise
  const auto have = [&](bool (NoiseGroup::*property)() const) {
    return points.size() >= enough && share(property) >= majority;
  };
  model.isCorrelated = have(&NoiseGroup::isCorrelated);
  model.isStrong = have(&NoiseGroup::isStrong);
  const bool isKnown = model.deviation > 0;
  if (model.isCorrelated || model.isStrong) {
    if (!isKnown)
      fitLaw(model, smoothingFor, smoothingPower);
    model.smoothing = smoothingForAll(model);
  } else if (!isKnown) {
    model.lengthening = lengtheningOf(model.groups);
    if (model.weighsPoints())
      fitLaw(
          model, [](const NoiseGroup& group) { return group.deviation; }, 1);
  }
  return model;
}

void setDeviations(OrientedPoints& points, const NoiseModel& model, Execution& execution)
{
  points.typicalDeviation = static_cast<float>(model.deviation);
  if (!points.deviations.empty())
    return;
  std::vector<float> deviations(points.size());
  forEach(execution, points.size(), 4096,
          [&](std::size_t i) { deviations[i] = static_cast<float>(model.deviationAt(points, i)); });
  points.deviations = std::move(deviations);
}

const Eigen::Vector3f& sensorOf(const PointArrays& points, std::size_t point)
{
  const std::vector<Eigen::Vector3f>& sensors = points.sensors;
  if (!points.views.empty() && points.views[point] >= 0 &&
      static_cast<std::size_t>(points.views[point]) < sensors.size())
    return sensors[points.views[point]];
  const auto distance = [&](const Eigen::Vector3f& sensor) { return (sensor - points.positions[point]).squaredNorm(); };
  return *std::min_element(sensors.begin(), sensors.end(), [&](const Eigen::Vector3f& s, const Eigen::Vector3f& t) {
    return distance(s) < distance(t);
  });
}

std::vector<float> deviationsByLaw(const NoiseLaw& law, const PointArrays& points, Execution& execution)
{
  std::vector<float> deviations;
  if (points.sensors.empty() || !law.isByRange())
    return deviations;
  deviations.resize(points.size());
  forEach(execution, deviations.size(), 1 << 14, [&](std::size_t i) {
    const double range = (points.positions[i] - sensorOf(points, i)).norm();
    // A point at its sensor has a range of 0, where a law without a constant gives a noise of 0.
    deviations[i] = std::max(static_cast<float>(law.deviation(range)), std::numeric_limits<float>::min());
  });
  return deviations;
}

} // namespace pcl::mrf

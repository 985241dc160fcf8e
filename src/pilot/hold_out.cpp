// SPDX-License-Identifier: BSD-3-Clause
#include "pilot/hold_out.h"

#include "base/loops.h"
#include "base/random.h"
#include "base/select_values.h"
#include "field/field_sampler.h"
#include "observation/observation.h"
#include "observation/point_observation.h"
#include "points/local_plane.h"
#include "solver/grids.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/report.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <tuple>

namespace pcl::mrf {
namespace {

constexpr std::size_t maxCubes = 32;
constexpr std::size_t firstCubes = 8; ///< cubes that are enough to recognize a clean scan
constexpr std::size_t fewCubes = 3;   ///< cubes that are enough to recognize a very clean scan
constexpr int cubeSide = 22;          ///< voxels of the finest size
constexpr double margin = 3;     ///< voxels at a cube's border, where the field differs from that of the whole cloud
constexpr int heldOutShare = 10; ///< one point in heldOutShare is held out
constexpr std::int64_t minHeldOut = 50; ///< min held-out points of a score

/// Distances too small to be seen, in spacings and as a share of the cloud's diagonal. If the mean distance is below
/// both, voxels may be larger.
constexpr double invisibleInSpacings = .04, invisibleShare = 2e-5;

/// True for one in heldOutShare of the indices, scattered.
bool isHeldOut(std::size_t index)
{
  return indexHash(index) % heldOutShare == 0;
}

/// Chooses points far from each other, at least `distance`, among random ones: cubes around them hold different points.
std::vector<Eigen::Vector3f> spread(const std::vector<Eigen::Vector3f>& positions, double distance)
{
  std::mt19937 random(1);
  std::vector<Eigen::Vector3f> candidates;
  for (std::size_t n = 0; n < 8 * maxCubes; ++n)
    candidates.push_back(positions[random() % positions.size()]);
  std::vector<Eigen::Vector3f> chosen;
  std::vector<float> nearest(candidates.size(), std::numeric_limits<float>::max());
  while (chosen.size() < maxCubes) {
    const auto farthest = std::max_element(nearest.begin(), nearest.end());
    if (*farthest < distance * distance)
      break;
    chosen.push_back(candidates[farthest - nearest.begin()]);
    for (std::size_t n = 0; n < candidates.size(); ++n)
      nearest[n] = std::min(nearest[n], (candidates[n] - chosen.back()).squaredNorm());
  }
  // The first points lie at the cloud's ends. Shuffled, so that any few of them stand for the whole cloud.
  for (std::size_t n = chosen.size(); n > 1; --n)
    std::swap(chosen[n - 1], chosen[random() % n]);
  return chosen;
}

/// Settings that are tried on all cubes.
struct Trial {
  double voxelSize;
  float gradientWeight;
  double discRadius; ///< points this close to a cube's center are held out, cloud's unit; 0: one point in ten

  bool operator<(const Trial& other) const
  {
    return std::tie(voxelSize, gradientWeight, discRadius) <
           std::tie(other.voxelSize, other.gradientWeight, other.discRadius);
  }
};

/// One of the cubes: a lattice, the points in it that the field sees, and the held-out points that score it.
struct Cube {
  Lattice lattice;
  OrientedPoints seen;
  std::vector<Eigen::Vector3f> heldOut;
  std::vector<float> field;                     ///< for the ℓ tried last: the start for the next
  std::map<double, std::vector<double>> errors; ///< by ℓ: one per held-out point

  /// \param core side of the inner cube in which points are held out, cloud's unit: the same for all trials compared
  Cube(const OrientedPoints& points, const NeighborSearch& search, const Eigen::Vector3f& center, const Trial& trial,
       double core)
  {
    const int side = static_cast<int>(std::ceil(core / trial.voxelSize + 2 * margin - 1e-6)) + 1;
    lattice.size = {side, side, side};
    lattice.spacing = trial.voxelSize;
    lattice.origin = center.cast<double>() - Eigen::Vector3d::Constant(trial.voxelSize * (side - 1) / 2);
    Neighbors around;
    search.within(center, static_cast<float>(std::sqrt(3.) * trial.voxelSize * side / 2), around);
    std::sort(around.indices.begin(), around.indices.end());
    std::vector<std::uint32_t> inside;
    for (const std::size_t i : around.indices) {
      const Eigen::Vector3d voxel = lattice.toVoxels(points.positions[i]);
      const bool isWithheld =
          trial.discRadius > 0 ? (points.positions[i] - center).norm() < trial.discRadius : isHeldOut(i);
      if (isWithheld) {
        if (2 * (points.positions[i] - center).cwiseAbs().maxCoeff() <= core)
          heldOut.push_back(points.positions[i]);
      } else if ((voxel.array() >= 0).all() && (voxel.array() <= side - 1).all()) {
        inside.push_back(static_cast<std::uint32_t>(i));
      }
    }
    seen = select(points, inside);
    if (seen.size() == 0)
      heldOut.clear();
    clip();
    field.assign(lattice.size.count(), 0);
  }

  /// Reduces the lattice to the box of its points and the margin, which is half of it where the surface is level.
  void clip()
  {
    Eigen::AlignedBox3f box;
    for (const auto* positions : {&seen.positions, &heldOut})
      for (const Eigen::Vector3f& p : *positions)
        box.extend(p);
    if (box.isEmpty())
      return;
    const Eigen::Array3d size(lattice.size.x, lattice.size.y, lattice.size.z);
    const Eigen::Array3d lower = (lattice.toVoxels(box.min()).array() - margin).floor().max(0),
                         upper = (lattice.toVoxels(box.max()).array() + margin).ceil().min(size - 1);
    const Eigen::Array3i clipped = (upper - lower).cast<int>() + 1;
    lattice.size = {clipped.x(), clipped.y(), clipped.z()};
    lattice.origin += lattice.spacing * lower.matrix();
  }

  /// Solves for one ℓ: the errors are the first-order distances of the held-out points from the field's zero level.
  void score(double smoothing, double spacing, const PointWeights& weights, Prior prior, double tolerance)
  {
    if (heldOut.empty())
      return;
    const auto [known, isNew] = errors.try_emplace(smoothing);
    if (!isNew)
      return;

    Execution serial(1);
    const WholeLevel level({lattice}, toSamples({seen, lattice, static_cast<float>(spacing)}, serial), weights, prior,
                           serial);
    level.solve(roughSolver(prior, tolerance), field, serial);
    const DistanceField distances(lattice, field, {});
    for (const Eigen::Vector3f& p : heldOut) {
      const double slope = slopeWithin(heldOutSlope, distances.sampleGradient(p));
      known->second.push_back(std::abs(distances.sampleDistance(p)) / slope);
    }
  }
};

/// Thickness of the layer of points around each held-out point: third over second eigenvalue of its nearest points.
std::vector<double> thicknesses(const Cube& cube, std::size_t neighbors)
{
  std::vector<double> result;
  if (cube.seen.size() < neighbors)
    return result;
  std::vector<std::pair<float, std::uint32_t>> byDistance(cube.seen.size());
  for (const Eigen::Vector3f& p : cube.heldOut) {
    for (std::uint32_t i = 0; i < byDistance.size(); ++i)
      byDistance[i] = {(cube.seen.positions[i] - p).squaredNorm(), i};
    const auto end = byDistance.begin() + neighbors;
    std::nth_element(byDistance.begin(), end - 1, byDistance.end());
    const Eigen::Vector3f& normal = cube.seen.normals[std::min_element(byDistance.begin(), end)->second];
    PlaneMoments moments(p);
    for (auto neighbor = byDistance.begin(); neighbor != end; ++neighbor) {
      const Eigen::Vector3f& position = cube.seen.positions[neighbor->second];
      const bool isBehind = cube.seen.normals[neighbor->second].dot(normal) <= 0 && (position - p).dot(normal) < 0;
      if (!isBehind) // on the other side of a thin object
        moments.add(position);
    }
    result.push_back(moments.plane().thirdToSecond);
  }
  return result;
}

/// Offset of the minimum of a parabola through three equidistant values from the middle one, in their distances.
double parabolaMinimum(double before, double middle, double after)
{
  const double curvature = before - 2 * middle + after;
  return curvature > 0 ? std::clamp((before - after) / (2 * curvature), -.5, .5) : 0;
}

/// The errors at the held-out points of all cubes, for one ℓ.
struct Score {
  double error = 0;                 ///< mean
  double noise = 0;                 ///< standard deviation, from the median
  std::vector<double> sums;         ///< sum of the errors in each cube
  std::vector<double> squares;      ///< sum of their squares in each cube
  std::vector<std::int64_t> counts; ///< held-out points in each cube

  /// \param errors cube by cube
  explicit Score(const std::vector<std::vector<double>>& errors)
  {
    std::vector<double> all;
    for (const std::vector<double>& ofCube : errors) {
      sums.push_back(std::accumulate(ofCube.begin(), ofCube.end(), 0.));
      squares.push_back(std::inner_product(ofCube.begin(), ofCube.end(), ofCube.begin(), 0.));
      counts.push_back(static_cast<std::int64_t>(ofCube.size()));
      all.insert(all.end(), ofCube.begin(), ofCube.end());
    }
    if (all.empty())
      return;
    error = std::accumulate(all.begin(), all.end(), 0.) / static_cast<double>(all.size());
    noise = deviationPerMedian * median(std::move(all));
  }

  std::int64_t heldOut() const { return std::accumulate(counts.begin(), counts.end(), std::int64_t{0}); }
};

/// How significantly the sum over the cubes is above zero: Student's t, divided by the quantile that it exceeds by
/// chance once in fifty times (within 1 % for four cubes or more).
double significance(const std::vector<double>& values)
{
  const auto count = static_cast<double>(values.size());
  const double sum = std::accumulate(values.begin(), values.end(), 0.), mean = sum / count;
  double squares = 0;
  for (const double value : values)
    squares += (value - mean) * (value - mean);
  const double freedom = std::max(1., count - 1), deviation = std::sqrt(squares * count / freedom);
  if (!(deviation > 0))
    return sum > 0 ? std::numeric_limits<double>::infinity() : 0;
  return sum / deviation / (2.05 + 2.5 / freedom + 5.4 / (freedom * freedom));
}

/// Significance above which a difference counts.
constexpr double significant = 1;

/// Significance of the differences between the errors (or their squares) of two trials at the same points: above zero
/// if the first errors are larger than `factor` times the second.
double compare(const Score& first, double factor, const Score& second, std::vector<double> Score::*errors)
{
  std::vector<double> differences;
  for (std::size_t c = 0; c < first.counts.size(); ++c)
    if (first.counts[c] > 0 && first.counts[c] == second.counts[c])
      differences.push_back((first.*errors)[c] - factor * (second.*errors)[c]);
  return significance(differences);
}

/// The same for the errors of one trial and a fixed error.
double compare(const Score& first, double error)
{
  std::vector<double> differences;
  for (std::size_t c = 0; c < first.sums.size(); ++c)
    differences.push_back(first.sums[c] - error * static_cast<double>(first.counts[c]));
  return significance(differences);
}

/// Whether cubes show a loss. \param significance of the loss in a number of cubes. A few cubes are enough to find a
/// loss. An edge that is lost may be in none of them, so that all cubes are asked before the answer is no.
template <typename Significance>
bool findsLoss(const Significance& significance)
{
  std::size_t cubes = 4;
  double loss = significance(cubes);
  while (loss <= significant && cubes < maxCubes) {
    cubes = std::min(cubes + cubes / 2, maxCubes);
    loss = significance(cubes);
  }
  return loss > 0;
}

/// The lengths that are tried are the shortest one times powers of √2, up to this power.
constexpr int longest = 6;

double length(int steps, double spacing)
{
  return std::pow(1.4142135623730951, steps) * shortestSmoothing(spacing);
}

/// The tried length closest to a length, within a fourth root of 2; the length itself if it is out of range. Its scores
/// are mostly known already, and the best choices for it are the best for the length as well.
double closestLength(double smoothing, double spacing)
{
  const double steps = std::round(2 * std::log2(smoothing / shortestSmoothing(spacing)));
  return steps >= 0 && steps <= longest ? length(static_cast<int>(steps), spacing) : smoothing;
}

/// How noisy a scan is, by the scores of the shortest two lengths.
enum class NoiseLevel { low, unclear, high };

NoiseLevel noiseLevel(const Score& shortest, const Score& second, double spacing, bool areFew)
{
  const double gain = second.error / shortest.error, noise = shortest.noise / spacing;
  constexpr double worthwhile = .95, clean = .1;
  if (!areFew)
    return gain > worthwhile && noise < clean ? NoiseLevel::low : NoiseLevel::high;
  // With about a hundred points, the ratio of the means is known to some 5 %, the median to some 12 %.
  if (gain > 1.05 && noise < .75 * clean)
    return NoiseLevel::low;
  return gain < .8 || noise > 1.5 * clean ? NoiseLevel::high : NoiseLevel::unclear;
}

/// Makes each cube once and scores it once per trial and length, for all choices.
class CrossValidation final : public HoldOut {
public:
  CrossValidation(const OrientedPoints& points, const NeighborSearch& search, float spacing, double finest, Prior prior,
                  float gradientWeight, Execution& execution)
      : points_(points), search_(search), spacing_(spacing), finest_(finest), prior_(prior),
        gradientWeight_(gradientWeight),
        invisible_(std::min(invisibleInSpacings * spacing, invisibleShare * boundingBox(points.positions).diagonal())),
        execution_(execution), core_((cubeSide - 1 - 2 * margin) * finest)
  {
    if (points.size() > 0)
      centers_ = spread(points.positions, (cubeSide - 2 * margin) * finest);
  }

  SmoothingChoice chooseSmoothing() override
  {
    SmoothingChoice choice;
    choice.smoothing = shortestSmoothing(spacing_);
    for (const std::size_t cubes : {fewCubes, firstCubes}) {
      const Score shortest = score(finest(), cubes, length(0, spacing_), 0);
      choice.heldOut = shortest.heldOut();
      if (choice.heldOut < minHeldOut)
        continue;
      const Score second = score(finest(), cubes, length(1, spacing_), 0);
      choice.noise = shortest.noise;
      choice.curve = {{length(0, spacing_), shortest.error}, {length(1, spacing_), second.error}};
      const NoiseLevel seen = noiseLevel(shortest, second, spacing_, cubes == fewCubes);
      if (seen == NoiseLevel::low)
        return choice;
      if (seen == NoiseLevel::high)
        break;
    }
    if (choice.heldOut < minHeldOut)
      return choice;
    choice.curve.clear();
    search(choice);
    return choice;
  }

  float chooseGradientWeight(double smoothing, double noise) override
  {
    constexpr float weaker = .4f, stronger = 4;
    // Below `noisy` spacings of noise positions are worth more. Discs' errors have to be below `fewer` times as large.
    constexpr double noisy = .2, fewer = .92;
    if (noise < noisy * spacing_)
      return weaker;
    smoothing = closestLength(smoothing, spacing_);
    const auto isBetter = [&](double factor, double discRadius) {
      for (std::size_t cubes = firstCubes;; cubes *= 2) {
        const Score strong = score({finest_, stronger, discRadius}, cubes, smoothing, noise),
                    weak = score({finest_, weaker, discRadius}, cubes, smoothing, noise);
        const double worse = compare(strong, factor, weak, &Score::sums);
        const bool isDecisive = worse > significant || (worse < -significant && 2 * cubes >= maxCubes);
        if (strong.heldOut() >= minHeldOut && (isDecisive || cubes >= maxCubes))
          return worse < 0;
        if (cubes >= maxCubes)
          return false;
      }
    };
    return isBetter(fewer, 6. * spacing_) && isBetter(1, 0) ? stronger : weaker;
  }

  ResolutionChoice chooseResolution(double smoothing, float gradientWeight, double noise) override
  {
    constexpr int steps = 4;
    constexpr double worse = 1.01;
    smoothing = closestLength(smoothing, spacing_);
    ResolutionChoice choice;
    choice.voxelSize = finest_;
    std::map<double, std::size_t> asked; // number of cubes, by voxel size
    const auto at = [&](double voxelSize, std::size_t cubes) {
      asked[voxelSize] = std::max(asked[voxelSize], cubes);
      return score({voxelSize, gradientWeight, 0}, cubes, smoothing, noise);
    };
    for (int step = 1; step < steps; ++step) {
      const double voxelSize = finest_ * std::pow(1.4142135623730951, step);
      const auto isVisible = [&](const Score& coarse, std::size_t) { return compare(coarse, invisible_); };
      const auto isWorse = [&](const Score& coarse, std::size_t cubes) {
        // Both are compared. In the mean, noise that larger voxels smooth on planes outweighs the edges that they lose;
        // in the squares, a few outliers hide all other errors.
        const Score& fine = at(finest_, cubes);
        return std::max(compare(coarse, worse, fine, &Score::sums),
                        compare(coarse, worse * worse, fine, &Score::squares));
      };
      const auto seesLoss = [&](const auto& loss) {
        return findsLoss([&](std::size_t cubes) {
          const Score coarse = at(voxelSize, cubes);
          return coarse.heldOut() < minHeldOut ? 0 : loss(coarse, cubes);
        });
      };
      // The finest voxels take most of the time: isWorse, which needs them, is asked last.
      const bool isTooCoarse = seesLoss(isVisible) && seesLoss(isWorse);
      choice.heldOut = at(voxelSize, asked[voxelSize]).heldOut();
      if (choice.heldOut < minHeldOut)
        return choice;
      if (isTooCoarse)
        break;
      choice.voxelSize = voxelSize;
    }
    fillCurve(asked, at, choice);
    return choice;
  }

private:
  Trial finest() const { return {finest_, gradientWeight_, 0}; }

  /// Scores a trial in up to `cubes` cubes. \param noise cloud's unit; the field need not be more exact
  Score score(const Trial& trial, std::size_t cubes, double smoothing, double noise)
  {
    const std::size_t used = std::min(cubes, centers_.size());
    std::vector<Cube>& made = cubes_[trial];
    while (made.size() < used)
      made.emplace_back(points_, search_, centers_[made.size()], trial, core_);
    // Max change of a solver step near the zero level, voxels; the error left is about twice as much.
    const double tolerance = std::max(3e-3, .04 * noise / trial.voxelSize);
    const PointWeights weights = pointWeights(prior_, smoothing, spacing_, trial.voxelSize, trial.gradientWeight);
    forEach(execution_, used, 1,
            [&](std::size_t c) { made[c].score(smoothing, spacing_, weights, prior_, tolerance); });
    execution_.poll();
    std::vector<std::vector<double>> errors;
    for (std::size_t c = 0; c < used; ++c)
      errors.push_back(made[c].errors[smoothing]);
    return Score(errors);
  }

  /// Reports the scores of all voxel sizes that were tried, in the cubes that all of them were scored in.
  template <typename Ask>
  void fillCurve(std::map<double, std::size_t> asked, const Ask& ask, ResolutionChoice& choice)
  {
    asked.try_emplace(finest_, firstCubes); // the finest size may not have been needed so far
    std::size_t cubes = maxCubes;
    for (const auto& [voxelSize, number] : asked)
      cubes = std::min(cubes, number);
    for (const auto& [voxelSize, number] : asked) {
      choice.cubes += static_cast<std::int64_t>(std::min(number, centers_.size()));
      const Score result = ask(voxelSize, cubes);
      choice.heldOut = result.heldOut();
      choice.curve.push_back({voxelSize, result.error});
    }
  }

  /// Tries lengths around the one that the noise asks for, until the score rises on both sides, and chooses ℓ.
  void search(SmoothingChoice& choice)
  {
    // This power is a length so long that the field follows no noise: the errors at the points are the noise.
    constexpr int reliable = 4;
    constexpr double rise = 1.01;
    const double noise = score(finest(), firstCubes, length(reliable, spacing_), .25 * spacing_).noise;
    const double guess = 2 * std::log2(smoothingForNoise(noise, spacing_) / shortestSmoothing(spacing_));

    std::map<int, double> errors;
    const auto tryLength = [&](int steps) {
      errors[steps] = score(finest(), maxCubes, length(steps, spacing_), noise).error;
    };
    int best = std::clamp(static_cast<int>(std::lround(guess)), 0, longest);
    tryLength(best);
    for (int up = best + 1; up <= longest; ++up) {
      tryLength(up);
      if (errors.at(up) > errors.at(best))
        break;
      best = up;
    }
    // Downwards, the search goes on past a rise of up to 1 %, which may be noise of the scores.
    for (int down = errors.begin()->first - 1; down >= 0; --down) {
      if (errors.at(down + 1) > rise * errors.at(best))
        break;
      tryLength(down);
      if (errors.at(down) < errors.at(best))
        best = down;
    }

    for (const auto& [steps, error] : errors)
      choice.curve.push_back({length(steps, spacing_), error});
    choice.smoothing = length(best, spacing_);
    const Score chosen = score(finest(), maxCubes, choice.smoothing, noise);
    choice.noise = chosen.noise;
    choice.heldOut = chosen.heldOut();
    const double atBest = errors.at(best);
    if (errors.count(best - 1) != 0 && errors.count(best + 1) != 0)
      choice.smoothing *= std::exp2(.5 * parabolaMinimum(errors.at(best - 1), atBest, errors.at(best + 1)));
    // Under strong noise the score has an accidental minimum at a short ℓ, which is deeper for stronger noise. If a
    // longer ℓ scores much worse, the errors are not noise, but edges and depths that it would smooth away.
    constexpr double strong = .8;
    const double shallow = choice.noise > strong * spacing_ ? 1.5 : 1.1;
    double longestAllowed = choice.smoothing;
    for (const auto& [steps, error] : errors)
      if (error <= shallow * atBest)
        longestAllowed = std::max(longestAllowed, length(steps, spacing_));
    choice.smoothing = std::max(choice.smoothing, std::min(longestAllowed, smoothingForNoise(choice.noise, spacing_)));
    if (isThick())
      smoothThickNoise(choice);
  }

  /// Whether the points lie in a layer so thick that a few of them show no surface: around three of four held-out
  /// points, the nearest 16 and the nearest 64 points are spread in all directions.
  bool isThick()
  {
    const auto firstQuartile = [&](std::size_t neighbors) {
      std::vector<double> all;
      for (std::size_t c = 0; c < std::min(firstCubes, cubes_[finest()].size()); ++c) {
        const std::vector<double> ofCube = thicknesses(cubes_[finest()][c], neighbors);
        all.insert(all.end(), ofCube.begin(), ofCube.end());
      }
      if (static_cast<std::int64_t>(all.size()) < minHeldOut)
        return 0.;
      const std::size_t rank = all.size() / 4;
      return valueAt(std::move(all), rank);
    };
    return firstQuartile(16) > .25 && firstQuartile(64) > .2;
  }

  /// Chooses ℓ by the errors that the longest ℓ leaves, which are noise. In a thick layer a short ℓ makes sheets of the
  /// zero level near every point, so that its errors are too small.
  void smoothThickNoise(SmoothingChoice& choice)
  {
    const Score smoothed = score(finest(), maxCubes, length(longest, spacing_), choice.noise);
    choice.noise = std::max(choice.noise, smoothed.noise);
    choice.smoothing =
        std::max(choice.smoothing, std::min(length(longest, spacing_), smoothingForNoise(choice.noise, spacing_)));
  }

  const OrientedPoints& points_;
  const NeighborSearch& search_;
  const float spacing_;
  const double finest_;
  const Prior prior_;
  const float gradientWeight_;
  const double invisible_; ///< mean distance below which voxels may be larger, cloud's unit
  Execution& execution_;
  const double core_; ///< side of the inner cubes with held-out points, the same for all voxel sizes, cloud's unit
  std::vector<Eigen::Vector3f> centers_; ///< of the cubes
  std::map<Trial, std::vector<Cube>> cubes_;
};

} // namespace

std::unique_ptr<HoldOut> makeHoldOut(const OrientedPoints& points, const NeighborSearch& search, float spacing,
                                     double voxelSize, Prior prior, const ObservationOptions& observation,
                                     Execution& execution)
{
  return std::make_unique<CrossValidation>(points, search, spacing, voxelSize, prior,
                                           resolvedGradientWeight(observation), execution);
}

} // namespace pcl::mrf

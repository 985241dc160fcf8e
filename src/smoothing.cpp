#include <pcl/surface/mrf/smoothing.h>

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/point_observation.h>
#include <pcl/surface/mrf/solver.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace pcl {
namespace mrf {
namespace {

constexpr std::size_t mostCubes = 32;
constexpr std::size_t firstCubes = 8; ///< that tell a clean scan, which needs no others
constexpr int cubeSide = 24;          ///< voxels
constexpr double margin = 4;     ///< voxels at a cube's border where the field is not what it would be inside the cloud
constexpr int heldOutShare = 10; ///< one point in so many
constexpr std::int64_t fewest = 50; ///< held-out points that say something

/// True for one in heldOutShare of the indices, scattered (Knuth's multiplicative hash).
bool isHeldOut(std::size_t index)
{
  return (static_cast<std::uint32_t>(index) * 2654435761u >> 16) % heldOutShare == 0;
}

/// Points far from each other, among a few random ones; at least `distance`, so that cubes around them judge by other
/// points.
std::vector<Eigen::Vector3f> spread(const std::vector<Eigen::Vector3f>& positions, double distance)
{
  std::mt19937 random(1);
  std::vector<Eigen::Vector3f> candidates;
  for (std::size_t n = 0; n < 8 * mostCubes; ++n)
    candidates.push_back(positions[random() % positions.size()]);
  std::vector<Eigen::Vector3f> chosen;
  std::vector<float> nearest(candidates.size(), std::numeric_limits<float>::max());
  while (chosen.size() < mostCubes) {
    const auto farthest = std::max_element(nearest.begin(), nearest.end());
    if (*farthest < distance * distance)
      break;
    chosen.push_back(candidates[static_cast<std::size_t>(farthest - nearest.begin())]);
    for (std::size_t n = 0; n < candidates.size(); ++n)
      nearest[n] = std::min(nearest[n], (candidates[n] - chosen.back()).squaredNorm());
  }
  return chosen;
}

/// One of the cubes: a lattice, the points in it that the field sees, and those that judge it.
struct Cube {
  Lattice lattice;
  OrientedPoints seen;
  std::vector<Eigen::Vector3f> judges;
  std::vector<float> field; ///< of the ℓ tried last: the start for the next

  Cube(const OrientedPoints& points, const Eigen::Vector3f& centre, double voxelSize)
  {
    lattice.size = {cubeSide, cubeSide, cubeSide};
    lattice.spacing = voxelSize;
    lattice.origin = centre.cast<double>() - Eigen::Vector3d::Constant(voxelSize * (cubeSide - 1) / 2);
    field.assign(static_cast<std::size_t>(lattice.size.count()), 0);
    const auto isInside = [&](const Eigen::Vector3f& p, double border) {
      const Eigen::Array3d voxel = lattice.toVoxels(p).array();
      return (voxel >= border).all() && (voxel <= cubeSide - 1 - border).all();
    };
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (isHeldOut(i)) {
        if (isInside(points.positions[i], margin))
          judges.push_back(points.positions[i]);
      } else if (isInside(points.positions[i], 0)) {
        seen.positions.push_back(points.positions[i]);
        seen.normals.push_back(points.normals[i]);
        if (!points.confidences.empty())
          seen.confidences.push_back(points.confidences[i]);
      }
    }
  }

  /// Solves for one ℓ. \return first-order distances of the judges from the field's zero level
  std::vector<double> judge(const PointWeights& weights, Prior prior)
  {
    Execution serial(1);
    LinearSystem<float> system;
    system.prior = {lattice.size, prior, {}};
    system.data = makePointDataTerm<float>(lattice.size, toSamples(seen, lattice), weights, lattice.spacing, serial);
    SolverOptions solver;
    solver.changeTolerance = 2e-3;
    solve(system, solver, lattice.spacing, field, serial);
    const DistanceField distances(lattice, field, {});
    // Where noise has flattened the field its values are small, where the field follows the noise its slope is large:
    // neither may pass for a small distance.
    constexpr double least = .1, most = 1;
    std::vector<double> errors;
    for (const Eigen::Vector3f& p : judges) {
      const double slope = std::clamp<double>(distances.sampleGradient(p).norm(), least, most);
      errors.push_back(std::abs(distances.sampleDistance(p)) / slope);
    }
    return errors;
  }
};

/// The minimum of a parabola through three equidistant values, as a multiple of the distance from the middle one.
double parabolaMinimum(double before, double middle, double after)
{
  const double curvature = before - 2 * middle + after;
  return curvature > 0 ? std::clamp((before - after) / (2 * curvature), -.5, .5) : 0;
}

std::int64_t judges(const std::vector<Cube>& cubes)
{
  std::int64_t count = 0;
  for (const Cube& cube : cubes)
    count += static_cast<std::int64_t>(cube.judges.size());
  return count;
}

/// What the judges say of one ℓ.
struct Verdict {
  SmoothingScore score;
  double noise = 0;
};

struct Judgement {
  const OrientedPoints& points;
  double spacing, voxelSize;
  Prior prior;
  double gradientWeight;
  std::vector<Eigen::Vector3f> centres; ///< of the cubes

  Judgement(const OrientedPoints& observed, double meanSpacing, double side, Prior order,
            const ObservationOptions& observation)
      : points(observed), spacing(meanSpacing), voxelSize(side), prior(order),
        gradientWeight(static_cast<double>(observation.gradientWeight)),
        centres(spread(observed.positions, (cubeSide - 2 * margin) * side))
  {}

  /// Up to so many cubes that have points to judge and to be judged by.
  std::vector<Cube> cubes(std::size_t most) const
  {
    std::vector<Cube> result;
    for (std::size_t c = 0; c < std::min(most, centres.size()); ++c) {
      result.emplace_back(points, centres[c], voxelSize);
      if (result.back().judges.empty() || result.back().seen.size() == 0)
        result.pop_back();
    }
    return result;
  }

  Verdict verdict(std::vector<Cube>& cubes, double smoothing, Execution& execution) const
  {
    std::vector<double> errors = judge(cubes, smoothing, execution);
    const double mean = std::accumulate(errors.begin(), errors.end(), 0.) / static_cast<double>(errors.size());
    std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
    constexpr double deviationPerMedian = 1.4826; // of a Gaussian's absolute value
    return {{smoothing, mean}, deviationPerMedian * errors[errors.size() / 2]};
  }

  /// The errors of all judges, cube by cube.
  std::vector<double> judge(std::vector<Cube>& cubes, double smoothing, Execution& execution) const
  {
    const PointWeights weights = pointWeights(prior, smoothing, spacing, voxelSize, gradientWeight);
    std::vector<std::vector<double>> errors(cubes.size());
    execution.forRange(static_cast<std::int64_t>(cubes.size()), 1, [&](std::int64_t begin, std::int64_t end) {
      for (auto c = static_cast<std::size_t>(begin); c < static_cast<std::size_t>(end); ++c)
        errors[c] = cubes[c].judge(weights, prior);
    });
    execution.poll();
    std::vector<double> all;
    for (const std::vector<double>& part : errors)
      all.insert(all.end(), part.begin(), part.end());
    return all;
  }
};

} // namespace

double shortestSmoothing(double spacing)
{
  return .5 * spacing;
}

double smoothingForNoise(double noise, double spacing)
{
  return std::max(shortestSmoothing(spacing), 1.5 * spacing * std::pow(noise / spacing, .4));
}

SmoothingChoice chooseSmoothing(const OrientedPoints& points, float spacing, double voxelSize, Prior prior,
                                const ObservationOptions& observation, Execution& execution)
{
  SmoothingChoice choice;
  choice.smoothing = shortestSmoothing(spacing);
  if (points.size() == 0)
    return choice;
  const Judgement judgement(points, spacing, voxelSize, prior, observation);
  constexpr double step = 1.4142135623730951;

  std::vector<Cube> cubes = judgement.cubes(firstCubes);
  choice.heldOut = judges(cubes);
  if (choice.heldOut < fewest)
    return choice;
  const Verdict shortest = judgement.verdict(cubes, choice.smoothing, execution);
  const Verdict second = judgement.verdict(cubes, step * choice.smoothing, execution);
  constexpr double worthwhile = .95, clean = .1;
  choice.noise = shortest.noise;
  choice.curve = {shortest.score, second.score};
  if (second.score.error > worthwhile * shortest.score.error && shortest.noise < clean * static_cast<double>(spacing))
    return choice;

  cubes = judgement.cubes(mostCubes);
  choice.heldOut = judges(cubes);
  choice.curve.clear();
  constexpr int longest = 6;
  constexpr double rise = 1.01;
  std::size_t best = 0;
  for (int steps = longest; steps >= 0; --steps) {
    const Verdict verdict = judgement.verdict(cubes, std::pow(step, steps) * shortestSmoothing(spacing), execution);
    choice.curve.push_back(verdict.score);
    if (verdict.score.error <= choice.curve[best].error) {
      best = choice.curve.size() - 1;
      choice.noise = verdict.noise;
    } else if (verdict.score.error > rise * choice.curve[best].error) {
      break;
    }
  }
  choice.smoothing = choice.curve[best].smoothing;
  if (best > 0 && best + 1 < choice.curve.size())
    choice.smoothing *= std::pow(
        step, -parabolaMinimum(choice.curve[best - 1].error, choice.curve[best].error, choice.curve[best + 1].error));
  // Under strong noise the score has its accidental minimum at a short ℓ.
  choice.smoothing = std::max(choice.smoothing, smoothingForNoise(choice.noise, spacing));
  std::reverse(choice.curve.begin(), choice.curve.end());
  return choice;
}

} // namespace mrf
} // namespace pcl

#include <pcl/surface/mrf/smoothing.h>

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/point_observation.h>
#include <pcl/surface/mrf/solver.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <random>

namespace pcl {
namespace mrf {
namespace {

constexpr std::size_t mostCubes = 32;
constexpr std::size_t firstCubes = 8; ///< that tell a clean scan, which needs no others
constexpr std::size_t glance = 3;     ///< cubes that tell a very clean one
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

/// Boxes around runs of points, so that a cube need not look at all of them. The points are sorted along a curve as
/// they are gathered; in any other order this is slower but not wrong.
class Runs {
public:
  Runs(const std::vector<Eigen::Vector3f>& positions, Execution& execution)
      : count_(positions.size()), boxes_((positions.size() + length - 1) / length)
  {
    execution.forRange(static_cast<std::int64_t>(count_), length, [&](std::int64_t begin, std::int64_t end) {
      Eigen::AlignedBox3f& box = boxes_[static_cast<std::size_t>(begin) / length];
      for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
        box.extend(positions[i]);
    });
  }

  /// Calls visit(i) for all points in the box, and some around it.
  template <typename Visit>
  void forEachNear(const Eigen::AlignedBox3f& box, const Visit& visit) const
  {
    for (std::size_t run = 0; run < boxes_.size(); ++run)
      if (boxes_[run].intersects(box))
        for (std::size_t i = run * length; i < std::min((run + 1) * length, count_); ++i)
          visit(i);
  }

private:
  static constexpr std::size_t length = 512;
  std::size_t count_;
  std::vector<Eigen::AlignedBox3f> boxes_;
};

/// One of the cubes: a lattice, the points in it that the field sees, and those that judge it.
struct Cube {
  Lattice lattice;
  OrientedPoints seen;
  std::vector<Eigen::Vector3f> judges;
  std::vector<float> field;                     ///< of the ℓ tried last: the start for the next
  std::map<double, std::vector<double>> errors; ///< by the ℓ that were tried

  /// \param core side of the cube around the centre whose points judge
  /// \param discRadius 0: one point in ten is left out; else all this close to the centre, cloud's unit
  Cube(const OrientedPoints& points, const Runs& runs, const Eigen::Vector3f& centre, double voxelSize, double core,
       double discRadius)
  {
    lattice.size = {cubeSide, cubeSide, cubeSide};
    lattice.spacing = voxelSize;
    lattice.origin = centre.cast<double>() - Eigen::Vector3d::Constant(voxelSize * (cubeSide - 1) / 2);
    const Eigen::Vector3f reach = Eigen::Vector3f::Constant(static_cast<float>(voxelSize * cubeSide / 2));
    runs.forEachNear({centre - reach, centre + reach}, [&](std::size_t i) {
      const Eigen::Vector3d voxel = lattice.toVoxels(points.positions[i]);
      const bool isWithheld = discRadius > 0 ? (points.positions[i] - centre).norm() < discRadius : isHeldOut(i);
      if (isWithheld) {
        if (2 * (points.positions[i] - centre).cwiseAbs().maxCoeff() <= core)
          judges.push_back(points.positions[i]);
      } else if ((voxel.array() >= 0).all() && (voxel.array() <= cubeSide - 1).all()) {
        seen.positions.push_back(points.positions[i]);
        seen.normals.push_back(points.normals[i]);
        if (!points.confidences.empty())
          seen.confidences.push_back(points.confidences[i]);
        if (!points.spacings.empty())
          seen.spacings.push_back(points.spacings[i]);
      }
    });
    field.assign(static_cast<std::size_t>(lattice.size.count()), 0);
  }

  /// Solves for one ℓ: the errors are the first-order distances of the judges from the field's zero level.
  void judge(double smoothing, double spacing, const PointWeights& weights, Prior prior, double tolerance)
  {
    const auto [known, isNew] = errors.try_emplace(smoothing);
    if (!isNew)
      return;

    Execution serial(1);
    LinearSystem<float> system;
    system.prior = {lattice.size, prior, {}};
    system.data = makePointDataTerm<float>(lattice.size, toSamples(seen, lattice, static_cast<float>(spacing), serial),
                                           weights, lattice.spacing, serial);
    SolverOptions solver;
    solver.changeTolerance = tolerance;
    // A few digits on a small grid: measured a fifth less work than with the solver's own.
    if (prior != Prior::membrane)
      solver.smootherDegree = 4;
    solve(system, solver, lattice.spacing, field, serial);
    const DistanceField distances(lattice, field, {});
    // Where noise has flattened the field its values are small, where the field follows the noise its slope is large:
    // neither may pass for a small distance.
    constexpr double least = .1, most = 1;
    for (const Eigen::Vector3f& p : judges) {
      const double slope = std::clamp<double>(distances.sampleGradient(p).norm(), least, most);
      known->second.push_back(std::abs(distances.sampleDistance(p)) / slope);
    }
  }
};

/// The minimum of a parabola through three equidistant values, as a multiple of the distance from the middle one.
double parabolaMinimum(double before, double middle, double after)
{
  const double curvature = before - 2 * middle + after;
  return curvature > 0 ? std::clamp((before - after) / (2 * curvature), -.5, .5) : 0;
}

/// What the judges say of one ℓ.
struct Verdict {
  SmoothingScore score;
  double noise = 0;
};

class Judgement {
public:
  /// \param finest voxel size of all that are compared: what is judged does not depend on the one that is tried
  Judgement(const OrientedPoints& points, double spacing, double voxelSize, double finest, Prior prior,
            const ObservationOptions& observation, Execution& execution, double discRadius = 0)
      : points_(points), runs_(points.positions, execution), spacing_(spacing), voxelSize_(voxelSize),
        discRadius_(discRadius), core_((cubeSide - 1 - 2 * margin) * finest), prior_(prior),
        gradientWeight_(resolvedGradientWeight(observation)),
        centres_(spread(points.positions, (cubeSide - 2 * margin) * finest))
  {}

  /// Judges by up to so many cubes from now on: those that have points to judge and to be judged by.
  /// \return the number of points that judge
  std::int64_t useCubes(std::size_t most)
  {
    for (; used_ < std::min(most, centres_.size()); ++used_) {
      cubes_.emplace_back(points_, runs_, centres_[used_], voxelSize_, core_, discRadius_);
      if (cubes_.back().judges.empty() || cubes_.back().seen.size() == 0)
        cubes_.pop_back();
    }
    std::int64_t judges = 0;
    for (const Cube& cube : cubes_)
      judges += static_cast<std::int64_t>(cube.judges.size());
    return judges;
  }

  /// \param noise of the points, as far as it is known: the field need not be exact beneath it
  Verdict verdict(double smoothing, double noise, Execution& execution)
  {
    // In voxels, of a step near the zero level; what is left after it is about twice as much.
    const double tolerance = std::max(2e-3, .02 * noise / voxelSize_);
    std::vector<double> errors = judge(smoothing, tolerance, execution);
    const double mean = std::accumulate(errors.begin(), errors.end(), 0.) / static_cast<double>(errors.size());
    std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
    constexpr double deviationPerMedian = 1.4826; // of a Gaussian's absolute value
    return {{smoothing, mean}, deviationPerMedian * errors[errors.size() / 2]};
  }

private:
  /// The errors of all judges, cube by cube.
  std::vector<double> judge(double smoothing, double tolerance, Execution& execution)
  {
    const PointWeights weights = pointWeights(prior_, smoothing, spacing_, voxelSize_, gradientWeight_);
    execution.forRange(static_cast<std::int64_t>(cubes_.size()), 1, [&](std::int64_t begin, std::int64_t end) {
      for (auto c = static_cast<std::size_t>(begin); c < static_cast<std::size_t>(end); ++c)
        cubes_[c].judge(smoothing, spacing_, weights, prior_, tolerance);
    });
    execution.poll();
    std::vector<double> all;
    for (const Cube& cube : cubes_) {
      const std::vector<double>& errors = cube.errors.at(smoothing);
      all.insert(all.end(), errors.begin(), errors.end());
    }
    return all;
  }

  const OrientedPoints& points_;
  Runs runs_;
  double spacing_, voxelSize_, discRadius_, core_;
  Prior prior_;
  double gradientWeight_;
  std::vector<Eigen::Vector3f> centres_; ///< of the cubes
  std::size_t used_ = 0;                 ///< centres whose cubes were made
  std::vector<Cube> cubes_;
};

/// The lengths that are tried: the shortest times powers of √2.
constexpr int longest = 6;

double length(int steps, double spacing)
{
  return std::pow(1.4142135623730951, steps) * shortestSmoothing(spacing);
}

/// Whether a scan is clean, as far as the shortest two lengths tell.
enum class Cleanness { clean, unclear, noisy };

Cleanness cleanness(const Verdict& shortest, const Verdict& second, double spacing, bool isGlance)
{
  const double gain = second.score.error / shortest.score.error, noise = shortest.noise / spacing;
  constexpr double worthwhile = .95, clean = .1;
  if (!isGlance)
    return gain > worthwhile && noise < clean ? Cleanness::clean : Cleanness::noisy;
  // About a hundred judges: the ratio of their means is known to some 5 %, their median to some 12 %.
  if (gain > 1.05 && noise < .75 * clean)
    return Cleanness::clean;
  return gain < .8 || noise > 1.5 * clean ? Cleanness::noisy : Cleanness::unclear;
}

/// The lengths around the one that the noise asks for, until the score rises on both sides.
void search(Judgement& judgement, double spacing, SmoothingChoice& choice, Execution& execution)
{
  // Long enough that no noise is followed, so that what is left is the noise.
  constexpr int reliable = 4;
  constexpr double rise = 1.01;
  const double noise = judgement.verdict(length(reliable, spacing), .25 * spacing, execution).noise;
  const double guess = 2 * std::log2(smoothingForNoise(noise, spacing) / shortestSmoothing(spacing));
  choice.heldOut = judgement.useCubes(mostCubes);

  std::map<int, Verdict> verdicts;
  const auto judge = [&](int steps) {
    verdicts.emplace(steps, judgement.verdict(length(steps, spacing), noise, execution));
  };
  const auto error = [&](int steps) { return verdicts.at(steps).score.error; };
  int best = std::clamp(static_cast<int>(std::lround(guess)), 0, longest);
  judge(best);
  for (int up = best + 1; up <= longest; ++up) {
    judge(up);
    if (error(up) > error(best))
      break;
    best = up;
  }
  // Downwards past a rise within the scores' own noise.
  for (int down = verdicts.begin()->first - 1; down >= 0; --down) {
    if (error(down + 1) > rise * error(best))
      break;
    judge(down);
    if (error(down) < error(best))
      best = down;
  }

  for (const auto& [steps, verdict] : verdicts)
    choice.curve.push_back(verdict.score);
  choice.smoothing = length(best, spacing);
  choice.noise = verdicts.at(best).noise;
  const double atBest = error(best);
  if (verdicts.count(best - 1) != 0 && verdicts.count(best + 1) != 0)
    choice.smoothing *= std::exp2(.5 * parabolaMinimum(error(best - 1), error(best), error(best + 1)));
  // Under strong noise the score has its accidental minimum at a short ℓ, a shallow one. Where a longer ℓ is much
  // worse, what the field misses is no noise but edges and depths that it would smooth away.
  constexpr double shallow = 1.1;
  double longestAllowed = choice.smoothing;
  for (const auto& [steps, verdict] : verdicts)
    if (verdict.score.error <= shallow * atBest)
      longestAllowed = std::max(longestAllowed, length(steps, spacing));
  choice.smoothing = std::max(choice.smoothing, std::min(longestAllowed, smoothingForNoise(choice.noise, spacing)));
}

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
  Judgement judgement(points, spacing, voxelSize, voxelSize, prior, observation, execution);
  for (const std::size_t cubes : {glance, firstCubes}) {
    choice.heldOut = judgement.useCubes(cubes);
    if (choice.heldOut < fewest)
      continue;
    const Verdict shortest = judgement.verdict(length(0, spacing), 0, execution);
    const Verdict second = judgement.verdict(length(1, spacing), 0, execution);
    choice.noise = shortest.noise;
    choice.curve = {shortest.score, second.score};
    const Cleanness seen = cleanness(shortest, second, spacing, cubes == glance);
    if (seen == Cleanness::clean)
      return choice;
    if (seen == Cleanness::noisy)
      break;
  }
  if (choice.heldOut < fewest)
    return choice;
  choice.curve.clear();
  search(judgement, spacing, choice, execution);
  return choice;
}

float chooseGradientWeight(const OrientedPoints& points, float spacing, double voxelSize, double smoothing,
                           double noise, Prior prior, const ObservationOptions& observation, Execution& execution)
{
  constexpr float weaker = .4f, stronger = 4;
  // Beneath so much noise positions are worth more than normals everywhere.
  constexpr double noisy = .2, fewer = .92;
  if (noise < noisy * spacing)
    return weaker;
  const auto error = [&](float weight, double discRadius) {
    ObservationOptions tried = observation;
    tried.gradientWeight = weight;
    Judgement judgement(points, spacing, voxelSize, voxelSize, prior, tried, execution, discRadius);
    if (judgement.useCubes(mostCubes) < fewest)
      return 0.;
    return judgement.verdict(smoothing, noise, execution).score.error;
  };
  const double radius = 6. * spacing;
  return error(stronger, radius) < fewer * error(weaker, radius) && error(stronger, 0) <= error(weaker, 0) ? stronger
                                                                                                           : weaker;
}

ResolutionChoice chooseResolution(const OrientedPoints& points, float spacing, double finest, double smoothing,
                                  Prior prior, const ObservationOptions& observation, Execution& execution)
{
  constexpr int steps = 4;
  constexpr double worse = 1.01, invisible = .04;
  // The mean of a hundred judged points is known to a tenth.
  constexpr double muchWorse = 1.25, visible = 1.5 * invisible;
  ResolutionChoice choice;
  choice.voxelSize = finest;
  if (points.size() == 0)
    return choice;
  for (const std::size_t cubes : {firstCubes, mostCubes}) {
    choice.curve.clear();
    choice.voxelSize = finest;
    for (int step = 0; step < steps; ++step) {
      const double voxelSize = finest * std::pow(1.4142135623730951, step);
      Judgement judgement(points, spacing, voxelSize, finest, prior, observation, execution);
      choice.heldOut = judgement.useCubes(cubes);
      if (choice.heldOut < fewest)
        break;
      choice.curve.push_back({voxelSize, judgement.verdict(smoothing, 0, execution).score.error});
      const double error = choice.curve.back().error, least = choice.curve.front().error;
      if (error > std::max(worse * least, invisible * spacing))
        break;
      choice.voxelSize = voxelSize;
    }
    if (choice.curve.size() == 2 &&
        choice.curve[1].error > std::max(muchWorse * choice.curve[0].error, visible * spacing))
      break;
  }
  return choice;
}

} // namespace mrf
} // namespace pcl

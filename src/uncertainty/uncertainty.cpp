// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/uncertainty.h"

#include "base/select_values.h"
#include "uncertainty/plausible_surfaces.h"
#include "uncertainty/uncertainty_evidence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace pcl::mrf {
namespace {

/// Factors that were fitted to simulated scans, see SigmaModel.
struct LearntFactors {
  double measured;      ///< σ amid data over the error that pairs share: with all points the error is smaller
  double bias;          ///< share in σ² of the squared distance to the points, as far as that exceeds their noise
  double errorPerNoise; ///< σ amid data over the noise, where noise dominates
  double fillings;      ///< σ in fillings over the errors of the coarse grid's fillings of discs
  double perChange;     ///< f over the RMS change by refinement, and over the noise, if there are no discs
  double perNoise;
  double growth; ///< growth of σ² with the change by refinement, at its upper quartile, on scans without noise
  double growthPerNoise; ///< reduction of that growth per squared ratio of noise to σ
  double perSharedNoise; ///< σ amid data over noise that neighbors share: if ℓ follows it, and if it is weak
  double perLittleSharedNoise;
  double growthUnderSharedNoise; ///< growth for both
};

constexpr LearntFactors learnt{.95, .5, .35, 1.4, 2.5, 1.2, 2.3, .6, .4, .9, .6};

/// Number of discs, and of pairs, that the learnt factors weigh as.
constexpr double patchesLearnt = 2, pairsLearnt = 20;

double squared(double value)
{
  return value * value;
}

/// \return 0 for no values
template <typename Value>
double quantileOrZero(const std::vector<Value>& values, double share)
{
  return values.empty() ? 0 : static_cast<double>(quantile(values, share));
}

/// The mean of values, each at most the 95th percentile. \return 0 for no values
double cappedMean(const std::vector<float>& values)
{
  const double limit = quantileOrZero(values, .95);
  double sum = 0;
  for (const float value : values)
    sum += std::min(static_cast<double>(value), limit);
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

/// σ² amid data and in fillings, lengths in the cloud's unit; src/method.md, "Error bars", explains the letters:
///
///     amid data     σ² = K a √(V / Ṽ) (1 + B min(δ²/δ₇₅², 64)) + s β²
///     in fillings   σ² = t² f² V + K
///
/// ln σ changes linearly from the first to the second where the nearest point is at half to all of its reach.
class SigmaModel {
public:
  /// \param evidence of the mesh's vertices \param run density and noise of the points
  SigmaModel(const std::vector<PieceEvidence>& pieces, const TriangleMesh& mesh, const std::vector<Evidence>& evidence,
             const Report& run, UncertaintyReport& report)
      : min_(squared(minPerSpacing * run.density.spacing)),
        underSharedNoise_(squared(shareOf(run.noise) * run.noise.deviation))
  {
    describeMeasured(mesh, evidence);
    fitMeasured(pieces, report);
    fitFillings(pieces, report);
  }

  double measured(const Evidence& e) const
  {
    const double amid = amidData(e);
    constexpr double rim = .5; // from here on points hold the surface on one side only
    const double share = std::clamp((static_cast<double>(e.reach) - rim) / (1 - rim), 0., 1.);
    if (e.isInPatch || !(share > 0))
      return amid;
    return amid * std::pow(std::max(filling(e) / amid, 1.), share);
  }

  double filling(const Evidence& e) const { return std::sqrt(factor_ * static_cast<double>(e.variance) + base_); }

  bool isCalibrated(const Evidence& e) const
  {
    return e.distance > 0 ? static_cast<double>(e.distance) <= farthestFilled_ : hasPairs_;
  }

private:
  /// The share of σ in noise that neighbors share; 0 if they do not share it.
  static double shareOf(const NoiseReport& noise)
  {
    return noise.isCorrelated ? learnt.perSharedNoise : noise.lengthening > 1 ? learnt.perLittleSharedNoise : 0;
  }

  double amidData(const Evidence& e) const
  {
    // A left-out disc tells nothing about the surface that has its points.
    return std::sqrt(base_ * (e.isInPatch ? areaOfPoint(e) * (1 + growth_ * medianChange_ / upperChange_) : shape(e)) +
                     biasShare_ * static_cast<double>(e.bias));
  }

  /// a, limited to the range that a neighborhood can tell.
  static double areaOfPoint(const Evidence& e) { return squared(std::clamp(static_cast<double>(e.spacing), .25, 4.)); }

  /// The factor of K in σ² amid data.
  double shape(const Evidence& e) const
  {
    constexpr double max = 64; // above it, the place is an edge or on a sheet that the coarse grid misses
    const double amount = underSharedNoise_ > 0 && e.noise > 0
                              ? squared(static_cast<double>(e.noise))
                              : areaOfPoint(e) * std::sqrt(static_cast<double>(e.variance) / medianVariance_);
    return amount * (1 + growth_ * std::min(static_cast<double>(e.change) / upperChange_, max));
  }

  void describeMeasured(const TriangleMesh& mesh, const std::vector<Evidence>& evidence)
  {
    std::vector<float> variances, changes, biases;
    for (std::size_t v = 0; v < evidence.size(); ++v)
      if (mesh.confidences[v] > 0 && !evidence[v].isInPatch) {
        variances.push_back(evidence[v].variance);
        changes.push_back(evidence[v].change);
        biases.push_back(evidence[v].bias);
      }
    constexpr double tiny = std::numeric_limits<float>::min();
    medianVariance_ = std::max(quantileOrZero(variances, .5), tiny);
    medianChange_ = quantileOrZero(changes, .5);
    upperChange_ = std::max(quantileOrZero(changes, .75), tiny);
    // Capped, because a few places where the coarse grid misses a sheet would dominate the mean.
    meanChange_ = cappedMean(changes);
    meanBias_ = cappedMean(biases);
  }

  void fitMeasured(const std::vector<PieceEvidence>& pieces, UncertaintyReport& report)
  {
    std::vector<double> squares, shared, differences;
    for (const PieceEvidence& piece : pieces)
      for (const HeldOutPair& pair : piece.pairs) {
        squares.push_back(static_cast<double>(pair.square()));
        shared.push_back(static_cast<double>(pair.shared()));
        differences.push_back(static_cast<double>(std::abs(pair.first - pair.second)));
      }
    // Limited, because one of a hundred pairs may be at an edge and dominate the others.
    const double limit = 9 * quantileOrZero(squares, .9);
    double square = 0, product = 0;
    for (std::size_t n = 0; n < squares.size(); ++n) {
      square += std::min(squares[n], limit);
      product += std::clamp(shared[n], -limit, limit);
    }
    const auto count = static_cast<double>(squares.size());
    hasPairs_ = count >= pairsLearnt;
    square /= std::max(count, 1.);
    product /= std::max(count, 1.);
    noise_ = squared(deviationPerMedian * quantileOrZero(differences, .5)) / 2;
    const double error = errorAmidData(product, square, count);
    biasShare_ = meanBias_ > 0 ? learnt.bias * std::max(1 - noise_ / nearestPoints / meanBias_, 0.) : 0;
    // Where refinement changes less than the error, as on a grid that is as fine, the change does not tell the error.
    growth_ = error > 0
                  ? learnt.growth / (1 + learnt.growthPerNoise * noise_ / error) * upperChange_ / (upperChange_ + error)
                  : learnt.growth;
    // The mean over the pairs is corrected to the mean over the surface, because their shape factors differ.
    double shapes = 0;
    for (const PieceEvidence& piece : pieces)
      for (const Evidence& e : piece.atPairs)
        shapes += shape(e);
    base_ = std::max(error, min_) / (shapes > 0 ? shapes / count : 1 + growth_ * meanChange_ / upperChange_);
    if (underSharedNoise_ > 0) {
      growth_ = learnt.growthUnderSharedNoise;
      base_ = underSharedNoise_;
    }
    report.noise = std::sqrt(noise_);
    report.heldOut = 2 * static_cast<std::int64_t>(squares.size());
    report.measuredError = std::sqrt(underSharedNoise_ > 0 ? base_ : error);
  }

  /// The mean σ² amid data: the error that pairs share, averaged with the error that the noise predicts.
  double errorAmidData(double product, double square, double pairs) const
  {
    if (!(pairs > 0))
      return .25 * meanChange_;       // nothing was left out: half of the coarse grid's error
    constexpr double minShare = .002; // of the squares: smaller values cannot be told from 0
    // For few pairs: `pairsLearnt` more are assumed to share a quarter of the squares, between clean and noisy scans.
    const double shared =
        std::max((pairs * product + pairsLearnt * square / 4) / (pairs + pairsLearnt), minShare * square);
    const double scale = squared(learnt.measured);
    const double seen = scale * shared, seenVariance = squared(scale * square) / pairs;
    const double expected = squared(learnt.errorPerNoise) * noise_,
                 expectedVariance = squared(.4 * expected) + squared(.5 * seen);
    return (seen * expectedVariance + expected * seenVariance) / (expectedVariance + seenVariance);
  }

  void fitFillings(const std::vector<PieceEvidence>& pieces, UncertaintyReport& report)
  {
    const double learntFactor =
        std::max(squared(learnt.perChange) * meanChange_ + squared(learnt.perNoise) * noise_, min_);
    double patches = 0;
    for (const PieceEvidence& piece : pieces)
      for (std::size_t n = 0; n < piece.filled.size(); ++n) {
        patches += n == 0 || piece.filled[n].patch != piece.filled[n - 1].patch ? 1 : 0;
        farthestFilled_ = std::max(farthestFilled_, static_cast<double>(piece.filled[n].distance));
      }
    factor_ = learntFactor;
    if (patches > 0) {
      const double seen = squared(learnt.fillings) * factorOfPatches(pieces, learntFactor);
      factor_ =
          std::exp((patches * std::log(seen) + patchesLearnt * std::log(learntFactor)) / (patches + patchesLearnt));
    }
    // Discs whose fillings have smaller errors than the noise allows are chance.
    constexpr double minPerNoise = .8;
    factor_ = std::max(factor_, squared(minPerNoise * learnt.perNoise) * noise_);
    report.patches = static_cast<std::int64_t>(patches);
    report.fillingFactor = std::sqrt(factor_);
    factor_ *= squared(studentHalfWidth(patches + patchesLearnt) / halfWidthPerSigma);
  }

  /// The f² for which the mean of e² / (f² V + noise) over the patches, each of its places, is 1. \param guess > 0
  double factorOfPatches(const std::vector<PieceEvidence>& pieces, double guess) const
  {
    constexpr double range = 400;
    double lower = guess / range, upper = guess * range;
    for (int step = 0; step < 40; ++step) {
      const double middle = std::sqrt(lower * upper);
      (meanRatio(pieces, middle, noise_ / nearestPoints) > 1 ? lower : upper) = middle;
    }
    return std::sqrt(lower * upper);
  }

  static double meanRatio(const std::vector<PieceEvidence>& pieces, double factor, double noise)
  {
    double sum = 0, patches = 0;
    for (const PieceEvidence& piece : pieces)
      for (std::size_t n = 0; n < piece.filled.size();) {
        const std::int32_t patch = piece.filled[n].patch;
        double ofPatch = 0, places = 0;
        for (; n < piece.filled.size() && piece.filled[n].patch == patch; ++n, ++places)
          ofPatch += squared(static_cast<double>(piece.filled[n].error)) /
                     (factor * static_cast<double>(piece.filled[n].variance) + noise);
        constexpr double max = 16; // a patch that found another sheet must not dominate
        sum += std::min(ofPatch / places, max);
        ++patches;
      }
    return sum / patches;
  }

  /// Minimum of σ amid data and of f, in l̄: on an exact plane they would be 0.
  static constexpr double minPerSpacing = 1e-4;

  const double min_;              ///< square of the minimum σ
  const double underSharedNoise_; ///< K if neighbors share their noise, else 0
  double medianVariance_ = 1, medianChange_ = 0, upperChange_ = 1, meanChange_ = 0;
  double noise_ = 0;          ///< σ² of the noise
  double base_ = 0;           ///< K
  double growth_ = 0;         ///< B
  double meanBias_ = 0;       ///< mean of β²
  double biasShare_ = 0;      ///< s
  double factor_ = 0;         ///< t² f²
  double farthestFilled_ = 0; ///< largest distance of the discs' fillings from the other points
  bool hasPairs_ = false;
};

/// The mean height of the curved surface above its triangles amid data.
double meanBulgeAmidData(const TriangleMesh& mesh)
{
  const std::vector<float> unmoved(mesh.vertices.size(), 0);
  double sum = 0, count = 0;
  for (const Triangle& triangle : mesh.triangles)
    if (std::all_of(triangle.begin(), triangle.end(), [&](std::int32_t v) { return mesh.confidences[v] > 0; })) {
      sum += MovedTriangle(mesh, unmoved, triangle).meanBulge();
      ++count;
    }
  return count > 0 ? sum / count : 0;
}

/// UncertaintyReport::offset. \param isFitted triangles are on the surface, so that vertices are higher
double meanOffset(const TriangleMesh& mesh, const std::vector<Evidence>& evidence, bool isFitted)
{
  double sum = 0, count = 0;
  for (std::size_t v = 0; v < evidence.size(); ++v)
    if (mesh.confidences[v] > 0) {
      sum += static_cast<double>(evidence[v].offset);
      ++count;
    }
  return count > 0 ? sum / count - (isFitted ? meanBulgeAmidData(mesh) : 0) : 0;
}

/// Sets the biases of the vertices, as the mean square over the corners of its triangles: where the surface crosses the
/// points from one side to the other, a vertex alone would seem exact.
void setBiases(const TriangleMesh& mesh, std::vector<Evidence>& evidence)
{
  std::vector<float> counts(evidence.size(), 0);
  for (const Triangle& corners : mesh.triangles)
    for (const std::int32_t to : corners)
      for (const std::int32_t from : corners)
        if (mesh.confidences[from] > 0) {
          const float offset = evidence[from].offset;
          evidence[to].bias += offset * offset;
          ++counts[to];
        }
  for (std::size_t v = 0; v < evidence.size(); ++v)
    evidence[v].bias /= std::max(counts[v], 1.f);
}

SigmaQuantiles quantilesOf(const std::vector<float>& sigmas)
{
  return {static_cast<std::int64_t>(sigmas.size()), quantileOrZero(sigmas, .5), quantileOrZero(sigmas, .95),
          quantileOrZero(sigmas, 1)};
}

} // namespace

void describeSigmas(const TriangleMesh& mesh, UncertaintyReport& report)
{
  std::vector<float> measured, fillings;
  for (std::size_t v = 0; v < mesh.sigmas.size(); ++v)
    (mesh.confidences[v] > 0 ? measured : fillings).push_back(mesh.sigmas[v]);
  report.measured = quantilesOf(measured);
  report.fillings = quantilesOf(fillings);
  report.notCalibrated = std::count(mesh.calibrated.begin(), mesh.calibrated.end(), 0);
}

UncertaintyReport estimateUncertainty(const std::vector<SolvedPiece>& pieces, const DistanceField& field,
                                      const Report& run, const ResolvedOptions& options, TriangleMesh& mesh,
                                      std::vector<PieceDraws>& draws, Execution& execution)
{
  UncertaintyReport report;
  report.isComputed = true;
  report.samples = numberOfDraws(options.uncertainty);
  std::vector<Evidence> evidence(mesh.vertices.size());
  const std::vector<std::vector<std::int32_t>> vertices = verticesOf(pieces, mesh.vertices);
  std::vector<PieceEvidence> ofPieces;
  const auto spacing = static_cast<float>(run.density.spacing);
  constexpr std::uint64_t step = std::uint64_t{1} << 32; // pieces err independently, also on equal grids
  for (std::size_t n = 0; n < pieces.size(); ++n) {
    execution.beginStep(static_cast<double>(n) / static_cast<double>(pieces.size()),
                        static_cast<double>(n + 1) / static_cast<double>(pieces.size()));
    ofPieces.push_back(gatherEvidence({pieces[n], field, mesh, vertices[n]}, spacing, options,
                                      options.solver.seed + n * step, evidence, execution));
    const PieceEvidence& piece = ofPieces.back();
    report.voxelSize = std::max(report.voxelSize, piece.voxelSize);
    report.voxels += piece.voxels;
    for (const Patch& patch : piece.patches) {
      report.patchPoints += static_cast<std::int64_t>(patch.points.size());
      report.largestPatch = std::max(report.largestPatch, 2 * static_cast<double>(patch.radius));
    }
  }

  setBiases(mesh, evidence);
  const SigmaModel model(ofPieces, mesh, evidence, run, report);
  mesh.sigmas.resize(mesh.vertices.size());
  mesh.calibrated.resize(mesh.vertices.size());
  for (std::size_t v = 0; v < evidence.size(); ++v) {
    mesh.sigmas[v] =
        static_cast<float>(mesh.confidences[v] > 0 ? model.measured(evidence[v]) : model.filling(evidence[v]));
    mesh.calibrated[v] = model.isCalibrated(evidence[v]) ? 1 : 0;
    report.largestOpening = std::max(report.largestOpening, 2 * static_cast<double>(evidence[v].distance));
  }
  describeSigmas(mesh, report);
  report.offset = meanOffset(mesh, evidence, options.remesher.fitsTriangles());
  for (std::size_t n = 0; n < pieces.size(); ++n)
    draws.push_back({pieces[n].volume, std::move(ofPieces[n].draws)});
  return report;
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// Whether the error bars of a mesh are right: how often they hold the error, how wide they are, how they rank.
#pragma once

#include "evaluation.h"

#include <array>
#include <cstdint>
#include <vector>

namespace mrf_apps {

/// A place where the error is known.
struct SigmaSample {
  double error;      ///< distance to the truth, cloud's unit, ≥ 0
  double sigma;      ///< cloud's unit, > 0
  double confidence; ///< 0: in a filling
  double weight;     ///< area that it stands for, or 1
};

/// The error bars of some places. Shares and means are weighted.
struct SigmaStatistics {
  static constexpr std::array<double, 3> levels{.5, .8, .95};

  std::int64_t count = 0; ///< all else is zero without any
  /// Share of the errors within ±.674, 1.282 and 1.960 sigma: .50, .80 and .95 if sigma is right.
  std::array<double, 3> coverage{};
  double rmsError = 0;        ///< cloud's unit
  double medianHalfWidth = 0; ///< of the 95 % interval, cloud's unit
  /// Mean of ln(σ/D) + (e/σ)²/2 + ½ ln 2π, D the diagonal: the smaller the better, and wide intervals do not win.
  double negativeLogLikelihood = 0;
};

/// How well a predictor orders the errors: the RMS error of what is left when the worst predicted share is left out,
/// over that of all, less the same with the errors themselves as the predictor, summed over all shares. 0 is perfect.
struct Sparsification {
  double sigma = 0, confidence = 0;
};

struct SigmaEvaluation {
  SigmaStatistics measured, fillings;
  Sparsification sparsification; ///< over both
  std::int64_t notKnown = 0;     ///< places left out: sigma or error is not finite or not positive
};

/// \param diagonal that likelihoods refer to, cloud's unit
SigmaEvaluation evaluateSigma(const std::vector<SigmaSample>& samples, double diagonal);

/// With a reference: the vertices, weighted by the area around them. Else the held-out points, or the noise-free ones,
/// and the vertex of the closest triangle that is nearest to each.
/// \param mesh with the field `sigma`, and `confidence` \param heldOutNoise standard deviation of the held-out points
/// along the normal, cloud's unit; 0: they are exact. What holds a point is an interval of √(sigma² + noise²), which
/// takes sigma's place. \throw pcl::mrf::InvalidInput if it lacks them, or if nothing is known that it could be
/// compared with
std::vector<SigmaSample> sigmaSamples(const SurfaceMesh& mesh, const EvaluationInput& input, double heldOutNoise,
                                      pcl::mrf::Execution& execution);

nlohmann::ordered_json toJson(const SigmaEvaluation& evaluation);

} // namespace mrf_apps

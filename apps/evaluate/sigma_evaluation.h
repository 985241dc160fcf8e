// SPDX-License-Identifier: BSD-3-Clause
/// Checks the error bars of a mesh: how often they hold the error, how wide they are, how they rank the errors.
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

/// Statistics of the error bars of several places. Shares and means are weighted.
struct SigmaStatistics {
  static constexpr std::array<double, 3> levels{.5, .8, .95};

  std::int64_t count = 0; ///< if it is 0, all else is 0
  /// Share of the errors within ±.674, 1.282 and 1.960 sigma: .50, .80 and .95 if sigma is right.
  std::array<double, 3> coverage{};
  double rmsError = 0;        ///< cloud's unit
  double medianHalfWidth = 0; ///< of the 95 % interval, cloud's unit
  /// Mean of ln(σ/D) + (e/σ)²/2 + ½ ln 2π, D the diagonal. Smaller is better; intervals that are too wide do not win.
  double negativeLogLikelihood = 0;
};

/// How well a predictor orders the errors. The RMS error without the places of the largest predictions, over the RMS
/// error of all places, is integrated over the share left out; that of the errors as predictor is subtracted. 0 is
/// perfect.
struct Sparsification {
  double sigma = 0, confidence = 0;
};

struct SigmaEvaluation {
  SigmaStatistics measured, fillings;
  Sparsification sparsification; ///< over both
  std::int64_t notKnown = 0;     ///< places left out: sigma or error is not finite, or sigma not positive
};

/// \param diagonal unit of lengths in likelihoods, cloud's unit
SigmaEvaluation evaluateSigma(const std::vector<SigmaSample>& samples, double diagonal);

/// The places where errors are known. With a reference: the vertices, weighted by the area around them. Else the
/// held-out and the noise-free points, each with the sigma of the nearest corner of the closest triangle.
/// \param mesh with the field `sigma`, and `confidence` \param heldOutNoise standard deviation of the held-out points
/// along the normal, cloud's unit; 0: they are exact. For them √(sigma² + noise²) takes the place of sigma. \throw
/// pcl::mrf::InvalidInput if the mesh lacks these fields, or if there is nothing to compare it with
std::vector<SigmaSample> sigmaSamples(const SurfaceMesh& mesh, const EvaluationInput& input, double heldOutNoise,
                                      pcl::mrf::Execution& execution);

nlohmann::ordered_json toJson(const SigmaEvaluation& evaluation);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "bar_figures.h"

namespace mrf_apps {

using nlohmann::json;

json toJson(const SigmaStatistics& statistics, double unit)
{
  if (statistics.count == 0)
    return nullptr;
  return {{"vertices", statistics.count},
          {"coverage", statistics.coverage},
          {"rms", statistics.rmsError / unit},
          {"halfWidth", statistics.medianHalfWidth / unit},
          {"likelihood", statistics.negativeLogLikelihood}};
}

SigmaStatistics statisticsOfAll(std::vector<SigmaSample> samples, double diagonal)
{
  for (SigmaSample& sample : samples)
    sample.confidence = 1;
  return evaluateSigma(samples, diagonal).measured;
}

json ranking(const std::vector<SigmaSample>& samples, const std::vector<double>& predictions)
{
  std::vector<double> errors;
  for (const SigmaSample& sample : samples)
    errors.push_back(sample.error);
  return {{"sparsification", sparsificationOf(samples, predictions)}, {"rank", rankCorrelation(errors, predictions)}};
}

void addRankings(const std::vector<SigmaSample>& samples, json& result)
{
  std::vector<double> sigmas, doubts;
  for (const SigmaSample& sample : samples) {
    sigmas.push_back(sample.sigma);
    doubts.push_back(-sample.confidence);
  }
  result["sigma"] = ranking(samples, sigmas);
  result["confidence"] = ranking(samples, doubts);
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What is kept of the error bars of a surface, as JSON.
#pragma once

#include "evaluate/sigma_evaluation.h"

#include <nlohmann/json.hpp>

#include <vector>

namespace mrf_apps {

/// Counts, coverage, lengths in a unit and likelihood; null of nothing. \param unit cloud's unit
nlohmann::json toJson(const SigmaStatistics& statistics, double unit);

/// The statistics of all samples, wherever they are. \param diagonal that likelihoods refer to, cloud's unit
SigmaStatistics statisticsOfAll(std::vector<SigmaSample> samples, double diagonal);

/// How well predictions order the errors. \param predictions one per sample, up to any rising function
nlohmann::json ranking(const std::vector<SigmaSample>& samples, const std::vector<double>& predictions);

/// Adds how well sigma and confidence do, under these names.
void addRankings(const std::vector<SigmaSample>& samples, nlohmann::json& result);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief An evaluation as JSON and as text.
#pragma once

#include "evaluation.h"
#include "sigma_evaluation.h"

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace mrf_apps {

/// Everything in the evaluation, under the names of its members. Statistics of distances come twice: in the cloud's
/// unit, and in per cent of the diagonal under the same name with `Percent` appended. Shares are 0..1. What was not
/// measured is not there.
nlohmann::ordered_json toJson(const Evaluation& evaluation);
nlohmann::ordered_json toJson(const SigmaEvaluation& evaluation);

/// The same to be read: a line per figure, a row per statistics; histograms are left out.
std::string toText(const nlohmann::ordered_json& json, const std::string& indent = {});

} // namespace mrf_apps

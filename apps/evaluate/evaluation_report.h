// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief An evaluation as text and as JSON.
#pragma once

#include "evaluation.h"
#include "sigma_evaluation.h"

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace mrf_apps {

/// A readable table, lines of at most 100 characters.
std::string toText(const Evaluation& evaluation);
std::string toText(const SigmaEvaluation& evaluation);

/// Everything in the evaluation, under the names of its members. Statistics of distances come twice: in the cloud's
/// unit, and in per cent of the diagonal under the same name with `Percent` appended. Shares are 0..1. What was not
/// measured is not there.
nlohmann::ordered_json toJson(const Evaluation& evaluation);
nlohmann::ordered_json toJson(const SigmaEvaluation& evaluation);

} // namespace mrf_apps

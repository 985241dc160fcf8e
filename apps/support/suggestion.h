// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief "Did you mean ...?"
#pragma once

#include <string>
#include <vector>

namespace mrf_apps {

/// The candidate that a mistyped word most likely stands for: it begins with the word, or is the fewest edits away from
/// it (letters inserted, dropped, changed, or swapped with the next), at most one in three letters.
/// \return empty if none is near
std::string nearestWord(const std::string& word, const std::vector<std::string>& candidates);

/// The end of a message: "; did you mean NEAREST?", or nothing.
std::string didYouMean(const std::string& word, const std::vector<std::string>& candidates);

} // namespace mrf_apps

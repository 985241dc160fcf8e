// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Sections as one self-contained HTML page, as CSV and as JSON.
#pragma once

#include "experiment.h"

#include <nlohmann/json.hpp>

#include <string>
#include <utility>
#include <vector>

namespace mrf_apps {

/// Name and value, for the top of the page.
using Facts = std::vector<std::pair<std::string, std::string>>;

struct Page {
  Facts facts;
  std::vector<Section> sections;
  int remaining = 0; ///< experiments that were asked for and are yet to come
};

/// Text for HTML: what has a meaning there is escaped.
std::string escaped(const std::string& text);

/// A cell as it is shown; a dash for null.
std::string cellText(const nlohmann::json& cell);

/// Without scripts or other files. \param folder where the pictures are; those that are missing are left out
std::string toHtml(const Page& page, const std::string& folder);

/// RFC 4180 with plain line feeds; null is empty.
std::string toCsv(const Table& table);

nlohmann::ordered_json toJson(const Page& page);

} // namespace mrf_apps

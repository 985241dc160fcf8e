// SPDX-License-Identifier: BSD-3-Clause
/// JSON files, and the report of a reconstruction as one.
#pragma once

#include <pcl/surface/mrf/report.h>

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace mrf_apps {

/// To be raised when a name in the report changes its meaning or goes.
constexpr int reportSchema = 3;

/// Everything in the report, under the names of its members, options under their own; lengths in the cloud's unit,
/// times in seconds.
nlohmann::ordered_json toJson(const pcl::mrf::Report& report);
nlohmann::ordered_json toJson(const pcl::mrf::MeshStatistics& mesh);

/// Writes a whole file; bytes that are no UTF-8 are replaced. \throw pcl::mrf::FileError, see OutputFiles::write
void writeJson(const std::string& path, const nlohmann::ordered_json& json);

/// How a type becomes JSON, where nlohmann-json looks for it: members under their own names.
#define MRF_ADD(member) json[#member] = value.member;
#define MRF_JSON(Type, ...)                                                                                            \
  static void to_json(nlohmann::ordered_json& json, const Type& value)                                                 \
  {                                                                                                                    \
    NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(MRF_ADD, __VA_ARGS__))                                                    \
  }

} // namespace mrf_apps

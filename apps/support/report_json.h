// SPDX-License-Identifier: BSD-3-Clause
/// JSON files, and the report of a reconstruction as one.
#pragma once

#include <pcl/surface/mrf/report.h>

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace mrf_apps {

/// Raise it when a name in the report changes its meaning or is removed.
constexpr int reportSchema = 3;

/// The whole report, under the names of its members and of the options; lengths in the cloud's unit, times in seconds.
nlohmann::ordered_json toJson(const pcl::mrf::Report& report);
nlohmann::ordered_json toJson(const pcl::mrf::MeshStatistics& mesh);

/// Writes a file; bytes that are not UTF-8 are replaced. \throw pcl::mrf::FileError, see OutputFiles::write
void writeJson(const std::string& path, const nlohmann::ordered_json& json);

/// Defines the function by which nlohmann-json converts a type: members under their own names.
#define MRF_ADD(member) json[#member] = value.member;
#define MRF_JSON(Type, ...)                                                                                            \
  static void to_json(nlohmann::ordered_json& json, const Type& value)                                                 \
  {                                                                                                                    \
    NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(MRF_ADD, __VA_ARGS__))                                                    \
  }

} // namespace mrf_apps

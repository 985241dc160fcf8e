// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief JSON files, and the report of a reconstruction as one.
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

} // namespace mrf_apps

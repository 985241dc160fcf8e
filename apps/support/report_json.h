// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The report of a reconstruction as JSON.
#pragma once

#include <pcl/surface/mrf/report.h>

#include <nlohmann/json_fwd.hpp>

namespace mrf_apps {

/// Everything in the report, under the names of its members, options under their keys; lengths in the cloud's unit,
/// times in seconds.
nlohmann::ordered_json toJson(const pcl::mrf::Report& report);
nlohmann::ordered_json toJson(const pcl::mrf::MeshStatistics& mesh);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The objects that are scanned, with the exact distance to each.
#pragma once

#include "experiment.h"

#include "scan/surface.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace mrf_apps {

/// An object in memory.
struct LoadedObject {
  std::unique_ptr<pcl::mrf::scan::Surface> surface;
  /// Exact distances from places to the surface.
  std::function<std::vector<double>(const std::vector<Eigen::Vector3d>&, pcl::mrf::Execution&)> distances;
};

/// An object that is loaded when it is first scanned.
struct ScanObject {
  std::string id, title;
  std::string origin; ///< where it comes from, for the page
  std::function<const LoadedObject&()> load;
};

/// What is there of: the bunny of Debian's glmark2-data, two closed scans of Debian's libcgal-demo, the scans of
/// options.data, and two generated shapes, which always are.
std::vector<ScanObject> scanObjects(const ExperimentOptions& options);

/// A mesh or a shape as an object.
LoadedObject loadMesh(const SurfaceMesh& mesh);
LoadedObject loadShape(const std::string& description);

} // namespace mrf_apps

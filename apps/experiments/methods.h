// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Methods of reconstruction under one call: ours with any options, PCL's, and programs on PATH.
#pragma once

#include "scan/scan.h"
#include "support/surface_mesh.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/options.h>

#include <functional>
#include <string>
#include <vector>

namespace mrf_apps {

struct Method {
  std::string id, title;
  /// \param points with unit normals, which are used as they are
  /// \param spacing mean distance to the closest other point, for options that are lengths
  /// \throw pcl::mrf::Error if there is no surface
  std::function<SurfaceMesh(const pcl::mrf::scan::Points& points, double spacing, pcl::mrf::Execution&)> run;
};

/// Changes the default options; lengths may depend on the spacing.
using Change = std::function<void(pcl::mrf::Options& options, double spacing)>;

/// Ours. Not remeshed unless the change asks for it: remeshing changes triangles, not the surface.
Method ours(const std::string& id, const std::string& title, const Change& change);

/// What bands and stopping early cost: every level is solved everywhere, to a two-hundredth of the default's last
/// change.
void solveExactly(pcl::mrf::Options& options, double spacing);

/// Ours: the default first, then with the other priors, with voxel-wise observations, with the preset `paper`, finer,
/// and solved exactly.
std::vector<Method> ownMethods();

/// pcl::Poisson with its other defaults.
Method poissonMethod(int depth = 8);

/// pcl::MarchingCubesHoppe with 128³ cells; see hoppe.h.
Method hoppeMethod();

/// PCL's, and PoissonRecon and SSDRecon with a depth of 8 where they are on PATH; times of the latter include files.
std::vector<Method> peerMethods();

/// A program that is given --in, --out and --depth. \param more arguments of its own
Method programMethod(const std::string& id, const std::string& title, const std::string& path, int depth = 8,
                     const std::vector<std::string>& more = {});

struct MethodResult {
  SurfaceMesh mesh;
  double processorSeconds = 0;
};

/// \throw pcl::mrf::Error
MethodResult run(const Method& method, const pcl::mrf::scan::Points& points, double spacing,
                 pcl::mrf::Execution& execution);

} // namespace mrf_apps

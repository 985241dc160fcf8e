// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Scans drawn at random, and what is checked of the meshes made from them.
#pragma once

#include "scan/scan.h"
#include "scan/surface.h"

#include <pcl/surface/mrf/reconstruction.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace mrf_apps {

struct RandomScan {
  std::string kind;   ///< of object: a shape of the catalog, or bunny
  std::string object; ///< as pcl_mrf_scan takes it
  pcl::mrf::scan::ScanOptions options;
  bool hasNormals = true;

  std::unique_ptr<pcl::mrf::scan::Surface> load() const;

  /// What repeats the scan and its reconstruction on a command line.
  std::string commands() const;
};

/// The scan of an index ≥ 0. Kinds of object take turns.
RandomScan randomScan(std::uint64_t seed, int index);

/// What is wrong with a mesh of the default trimming, in words; empty if nothing is.
std::vector<std::string> faultsOf(const pcl::mrf::Reconstruction& result, pcl::mrf::Execution& execution);

} // namespace mrf_apps

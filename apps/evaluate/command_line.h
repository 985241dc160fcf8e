// SPDX-License-Identifier: BSD-3-Clause
/// The command line of pcl_mrf_evaluate.
#pragma once

#include "evaluation.h"

#include <string>

namespace mrf_apps {

/// The options of the tool. Empty paths were not given.
struct EvaluateCommand {
  std::string mesh;
  std::string cloud, heldOut, clean, reference;
  std::string json, colored;
  EvaluationOptions options;
  double noise = 0; ///< standard deviation of the held-out points, cloud's unit; 0: they are exact
  int threads = 0;
  bool merge = false; ///< merge vertices of the mesh with equal coordinates
  bool sigma = false; ///< check the error bars of the mesh
  bool quiet = false;
};

/// Parses and checks everything that can be checked without opening a file. \throw UsageError, Information
EvaluateCommand parseEvaluateCommandLine(int argc, const char* const* argv);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// The command line of pcl_mrf_reconstruction.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/options.h>

#include <Eigen/Core>

#include <string>
#include <vector>

namespace mrf_apps {

enum class Verbosity { quiet, normal, verbose };

/// One reconstruction. Empty paths: not asked for. "-" is standard input or output.
struct Job {
  std::vector<std::string> inputs; ///< of one cloud
  std::string output;
  std::string report, field, picture;
  std::string tiles;        ///< folder of the mesh in tiles
  std::string outputFormat; ///< extension of a mesh file, lower case
};

/// What the user asks for.
struct Command {
  std::vector<Job> jobs;       ///< one, or several with a folder of outputs
  std::string outputDirectory; ///< to be made if it is not there; empty: the single job names its output
  std::string inputFormat;     ///< extension that stands for that of all inputs; empty: their own
  pcl::mrf::Options options;   ///< the preset with the explicit options on top
  std::vector<Eigen::Vector3d> sensors;
  std::string sensorsFile, viewsFile;
  std::size_t tileTriangles = 1000000; ///< of each tile, at most
  std::string camera;                  ///< of pictures, as wrongCamera accepts it; empty: the default
  Verbosity verbosity = Verbosity::normal;
  std::string workDirectory; ///< of results of parts of the run; empty: none are kept
  bool isResumed = false;
  pcl::mrf::TaskRunner* ranks = nullptr;      ///< that mpirun has started
  pcl::mrf::TaskDirectory* results = nullptr; ///< in the work directory
  bool hasProgress = false;                   ///< to be told also where standard error is no terminal
  std::string information;                    ///< text of --help or its like; if set, the rest is not
};

/// Parses and checks everything that can be checked without opening a file. \throw UsageError
Command parseCommandLine(int argc, const char* const* argv);

} // namespace mrf_apps

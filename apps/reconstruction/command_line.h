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

/// One reconstruction. Empty paths were not given. "-" is standard input or output.
struct Job {
  std::vector<std::string> inputs; ///< all of one cloud
  std::string output;
  std::string report, field, picture;
  std::string tiles;        ///< folder for the mesh in tiles
  std::string outputFormat; ///< extension of a mesh file, lower case
};

/// The options of the tool.
struct Command {
  std::vector<Job> jobs;       ///< one, or several with an output directory
  std::string outputDirectory; ///< made if it does not exist; empty: the single job names its output
  std::string inputFormat;     ///< extension used instead of those of the inputs; empty: their own
  pcl::mrf::Options options;   ///< the preset with the explicit options on top
  std::vector<Eigen::Vector3d> sensors;
  std::string sensorsFile, viewsFile;
  std::size_t tileTriangles = 1000000; ///< maximum number in a tile
  std::string camera;                  ///< of pictures, as wrongCamera accepts it; empty: the default
  Verbosity verbosity = Verbosity::normal;
  std::string workDirectory; ///< for the results of parts of the run; empty: none are kept
  bool isResumed = false;
  pcl::mrf::TaskRunner* ranks = nullptr;      ///< the processes that mpirun started
  pcl::mrf::TaskDirectory* results = nullptr; ///< those in the work directory
  bool hasProgress = false;                   ///< show progress even if standard error is no terminal
};

/// Parses and checks everything that can be checked without opening a file. \throw UsageError, Information
Command parseCommandLine(int argc, const char* const* argv);

} // namespace mrf_apps

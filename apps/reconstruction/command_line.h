/// \file
/// \brief The command line of pcl_mrf_reconstruction.
#pragma once

#include <pcl/surface/mrf/options.h>

#include <Eigen/Core>

#include <string>
#include <vector>

namespace mrf_apps {

enum class Verbosity { quiet, normal, verbose };

/// What the user asks for. Empty paths: not asked for.
struct Command {
  std::string input, output;
  std::string report, field, picture;
  pcl::mrf::Options options; ///< the preset with the explicit options on top
  std::vector<Eigen::Vector3d> sensors;
  std::string sensorsFile, viewsFile;
  Verbosity verbosity = Verbosity::normal;
  std::string information; ///< text of --help or --version; if set, the rest is not
};

/// Parses and checks everything that can be checked without opening a file. \throw UsageError
Command parseCommandLine(int argc, const char* const* argv);

} // namespace mrf_apps

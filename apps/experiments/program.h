// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Other programs: found on PATH, run silently, timed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace mrf_apps {

/// \return the path of an executable file of this name in one of PATH's folders; empty if there is none
std::string findProgram(const std::string& name);

/// Runs a program without input and output and waits for it. \param command the path of the program first
/// \throw pcl::mrf::InvalidInput if it cannot be started or does not end with status 0
void runProgram(const std::vector<std::string>& command);

/// A folder that lasts as long as the object.
class TemporaryFolder {
public:
  /// \throw FileError
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string path(const std::string& file) const { return (folder_ / file).string(); }

private:
  std::filesystem::path folder_;
};

/// Seconds of all processors, which other programs do not change much; those of programs that were waited for included.
class Stopwatch {
public:
  Stopwatch();
  double processorSeconds() const;

private:
  double start_;
};

} // namespace mrf_apps

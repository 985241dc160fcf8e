/// \file
/// \brief What the tool prints: progress and the closing summary.
#pragma once

#include "command_line.h"

#include <pcl/surface/mrf/report.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace mrf_apps {

/// A bar on standard error if that is a terminal, else a line per stage on standard output.
class ProgressDisplay {
public:
  explicit ProgressDisplay(Verbosity verbosity);
  ~ProgressDisplay() { clear(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  void show(const std::string& stage, double fraction);

  /// Removes the bar.
  void clear();

private:
  Verbosity verbosity_;
  bool terminal_;
  bool drawn_ = false;
  std::string stage_;
  std::chrono::steady_clock::time_point start_, last_;
};

/// What the summary tells besides the report.
struct RunSummary {
  std::string input;
  std::size_t points = 0;
  std::vector<std::string> fields; ///< what came with the points
  std::vector<std::string> notes;
  double readingSeconds = 0, writingSeconds = 0;
  std::vector<std::pair<std::string, std::int64_t>> written; ///< path and bytes
};

/// Prints the closing summary to standard output, warnings to standard error.
void printSummary(const RunSummary& run, const pcl::mrf::Report& report, Verbosity verbosity);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// What the tool prints: progress and the closing summary.
#pragma once

#include "command_line.h"

#include <pcl/surface/mrf/report.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace mrf_apps {

/// Shows the progress of the run on standard error: a bar on a terminal, lines elsewhere if they are asked for.
class ProgressDisplay {
public:
  /// \param jobs number of jobs, done one after the other
  ProgressDisplay(const Command& command, std::size_t jobs);
  ~ProgressDisplay() { clear(); }
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// \param job number of the running job, from 0 \param fraction of this job that is done, 0..1
  void show(std::size_t job, const std::string& stage, double fraction);

  /// Removes the bar.
  void clear();

private:
  std::size_t jobs_;
  bool isShown_ = false, isTerminal_;
  bool isDrawn_ = false;
  std::string title_;
  int toldPercent_ = 0;
  std::chrono::steady_clock::time_point start_, last_;
};

/// The data that the summary prints besides the report.
struct RunSummary {
  std::string input;
  std::size_t points = 0;
  std::vector<std::string> fields; ///< data that came with the points
  std::vector<std::string> notes;
  double readingSeconds = 0, writingSeconds = 0;
  std::vector<std::pair<std::string, std::int64_t>> written; ///< path and bytes
};

/// Prints the warnings to standard error. \param input printed in front of each; may be empty
void printWarnings(const pcl::mrf::Report& report, const std::string& input = {});

/// Prints the closing summary, and warnings to standard error. \param log where to print, such as stdout
void printSummary(const RunSummary& run, const pcl::mrf::Report& report, Verbosity verbosity, std::FILE* log);

/// The same in one line, for one of several jobs.
void printLine(const RunSummary& run, const pcl::mrf::Report& report, Verbosity verbosity);

} // namespace mrf_apps

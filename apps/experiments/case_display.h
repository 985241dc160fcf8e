// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Tells which case of which experiment runs, and how many are left.
#pragma once

#include "laboratory.h"

#include <chrono>
#include <map>
#include <string>

namespace mrf_apps {

/// A bar on standard error if that is a terminal, else a line per case on standard output.
class CaseDisplay {
public:
  explicit CaseDisplay(bool isQuiet);
  ~CaseDisplay() { clear(); }
  CaseDisplay(const CaseDisplay&) = delete;
  CaseDisplay& operator=(const CaseDisplay&) = delete;

  void expect(const std::string& experiment, const Plan& plan);
  void beginExperiment(const std::string& id);
  CaseObserver observer();

  /// Removes the bar.
  void clear();

private:
  void begin(const std::string& key);
  void end(bool isNew);

  bool isQuiet_, isTerminal_, isDrawn_ = false;
  std::map<std::string, Plan> plans_;
  std::string experiment_;
  int done_ = 0;     ///< cases of this experiment
  int finished_ = 0; ///< cases of former experiments
  int expected_ = 0; ///< of all experiments
  int measured_ = 0; ///< by this run
  int missing_ = 0;  ///< that this run has to measure, of all
  std::chrono::steady_clock::time_point start_;
};

} // namespace mrf_apps

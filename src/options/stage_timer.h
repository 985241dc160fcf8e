// SPDX-License-Identifier: BSD-3-Clause
/// Timers of a run and its stages.
#pragma once

#include "base/memory.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/report.h>

#include <chrono>
#include <vector>

namespace pcl::mrf {

using Clock = std::chrono::steady_clock;

inline double secondsSince(Clock::time_point start)
{
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Begins a stage and adds it to the report; the destructor sets its wall-clock time.
class StageTimer {
public:
  StageTimer(const char* stage, Report& report, Execution& execution) : times_(report.times), entry_(times_.size())
  {
    execution.beginStage(stage);
    times_.push_back({stage, 0}); // here and not in the destructor, which may not throw
  }
  ~StageTimer() { times_[entry_].seconds = secondsSince(start_); }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

private:
  std::vector<StageTime>& times_;
  std::size_t entry_;
  Clock::time_point start_ = Clock::now();
};

/// Its destructor sets the run's time and peak memory in the report, also after an exception.
class RunTimer {
public:
  explicit RunTimer(Report& report) : report_(report) {}
  ~RunTimer()
  {
    report_.seconds = secondsSince(start_);
    report_.peakBytes = peakMemory();
  }
  RunTimer(const RunTimer&) = delete;
  RunTimer& operator=(const RunTimer&) = delete;

private:
  Report& report_;
  Clock::time_point start_ = Clock::now();
};

} // namespace pcl::mrf

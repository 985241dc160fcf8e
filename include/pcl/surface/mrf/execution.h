// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Threads, progress and cancellation: the one object every stage is handed besides its input and its options.
#pragma once

#include <pcl/surface/mrf/export.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace pcl {
namespace mrf {

/// Called with the running stage's name and the fraction of the whole run that is done, 0..1, which never falls;
/// returning false cancels the run. Always called from the thread that runs the reconstruction, also while the others
/// are at work; several times a second, so that the fraction, part of which is estimated from the time, moves steadily.
/// Of a stage that is called alone the fraction is that of the stage.
using ProgressCallback = std::function<bool(const std::string& stage, double fraction)>;

/// A stage of a run and the seconds that it is expected to take. Only their ratios count, but for the first stage's.
struct ExpectedStage {
  std::string stage;
  double seconds = 0;
};

/// A fixed set of worker threads, a progress callback and a cancellation flag.
///
/// Work is cut into chunks whose bounds depend on the problem alone, never on the number of threads, and partial sums
/// are added in the order of the chunks: results are the same bytes for any number of threads.
/// The workers sleep while there is nothing to do (no spinning).
///
/// An Execution runs one parallel loop at a time; loops must not be nested.
class PCL_MRF_EXPORT Execution {
public:
  /// \param threads number of threads, the calling one included; 0 = one per hardware thread. Where the system does not
  /// let so many start, there are fewer.
  explicit Execution(int threads = 1, ProgressCallback progress = {});
  ~Execution();
  Execution(const Execution&) = delete;
  Execution& operator=(const Execution&) = delete;

  int threads() const { return threads_; }

  /// Calls body(begin, end) on consecutive ranges of at most `grain` indices that cover [0, count).
  /// Ranges run concurrently; an exception thrown by one of them is rethrown here after all have stopped.
  void forRange(std::int64_t count, std::int64_t grain,
                const std::function<void(std::int64_t begin, std::int64_t end)>& body);

  /// Sum of body(begin, end) over the ranges of forRange, added in their order in double precision.
  double sum(std::int64_t count, std::int64_t grain,
             const std::function<double(std::int64_t begin, std::int64_t end)>& body);

  /// Begins a run of several stages, in this order: from now on the callback is given the fraction of all of them, and
  /// forRange calls it as well. A stage that is left out takes no time; one that is not expected adds none.
  void beginRun(std::vector<ExpectedStage> stages);

  /// All stages are done: reports the fraction 1, and what follows is no part of the run. \throw Cancelled if the
  /// callback returns false
  void endRun();

  /// Names the stage that subsequent progress belongs to, and reports it; of a stage alone with fraction 0.
  void beginStage(const std::string& name);

  /// Confines the fractions that follow to a part of the current stage, [from, to]: a solver reports its own 0..1
  /// without knowing that it is one level of many.
  void beginStep(double from, double to);

  /// Reports the fraction of the current step that is done, 0..1. What the callback sees never falls inside a stage or
  /// a run. \throw Cancelled if the callback returns false
  void progress(double fraction);

  /// Reports the last fraction again: a step that cannot tell its own share gives the callback a chance to cancel.
  /// \throw Cancelled if the callback returns false
  void poll();

private:
  struct Workers;
  class Run;

  /// Inside a loop: reports if the last report is some time ago. \throw Cancelled
  void tick();

  int threads_;
  ProgressCallback callback_;
  std::string stage_;
  double fraction_ = 0, stepBegin_ = 0, stepEnd_ = 1;
  std::chrono::steady_clock::time_point lastCall_;
  std::unique_ptr<Run> run_; ///< none: stages are called alone
  std::unique_ptr<Workers> workers_;
};

} // namespace mrf
} // namespace pcl

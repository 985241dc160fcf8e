// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Threads, progress, cancellation and tasks: the one object every stage is handed besides its input and
/// options.
#pragma once

#include <pcl/surface/mrf/export.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace pcl::mrf {

/// Called with the running stage's name and the fraction of the whole run that is done, 0..1, which never falls (of a
/// stage that is called alone, of the stage); returning false cancels the run. Always called from the thread that runs
/// the reconstruction, several times a second.
using ProgressCallback = std::function<bool(const std::string& stage, double fraction)>;

/// A stage of a run and the seconds that it is expected to take. Only their ratios count, but for the first stage's.
struct ExpectedStage {
  std::string stage;
  double seconds = 0;
};

class Execution;

/// Does tasks: parts of a run that are functions of bytes to bytes, so that other processes can do them, and their
/// results be kept. \see storedTasks, tasksOfRanks
class PCL_MRF_EXPORT TaskRunner {
public:
  /// Makes the input of a task, when it is about to be done, in ascending order. None: it need not be.
  using MakeInput = std::function<std::optional<std::string>(int task)>;
  /// Takes a result, in ascending order; an empty one where there was no input.
  using UseResult = std::function<void(int task, std::string result)>;

  virtual ~TaskRunner() = default;

  /// Does tasks of a kind. \throw what a task throws; Cancelled; ResourceLimit
  virtual void run(const std::string& kind, int count, const MakeInput& makeInput, const UseResult& useResult,
                   Execution& execution) = 0;
};

/// Keeps results of tasks in the files of a directory: a run that was ended can go on from there. A file is named for
/// the checksum of its task's input, and has one of its own; what does not match is done again.
/// \param inner does the tasks; none: this process does, one after the other
/// \throw FileError if the directory cannot be made, or has results of an earlier run and `resume` is not set
class PCL_MRF_EXPORT TaskDirectory : public TaskRunner {
public:
  TaskDirectory(std::string directory, bool resume, TaskRunner* inner = nullptr);
  ~TaskDirectory() override;

  /// \throw ResourceLimit if results are going to find no room or cannot be written, or change meanwhile
  void run(const std::string& kind, int count, const MakeInput& makeInput, const UseResult& useResult,
           Execution& execution) override;

  /// Results that were found, and that were made.
  int found() const { return found_; }
  int made() const { return made_; }

  /// Bytes that the run may take, where nobody says how many: those of the run that is resumed, whose tasks they have
  /// cut. \param now what they would be otherwise, for the journal
  std::size_t memory(std::size_t now);

  /// Removes the results of this run, as nobody is going to need them any more, and the directory if it was made for
  /// it.
  void remove();

private:
  void requireRoom(const std::string& kind, double bytes) const;
  void note(const std::string& line);

  std::string directory_;
  TaskRunner* inner_;
  bool isOwn_ = false;            ///< it was made for the results
  int journal_ = -1;              ///< a file, locked
  std::size_t memory_ = 0;        ///< in the journal, or for it; 0: nobody has asked
  std::vector<std::string> used_; ///< files of results
  int found_ = 0, made_ = 0;
};

/// The processes that mpirun has started: rank 0 runs, and gives tasks to all ranks, which share the threads of its
/// Execution with those of the same machine. On the others the function does tasks until rank 0's runner has gone, and
/// returns none. \throw ResourceLimit if libpcl_mrf_mpi cannot be loaded
PCL_MRF_EXPORT std::unique_ptr<TaskRunner> tasksOfRanks();

/// A fixed set of worker threads, which sleep while there is nothing to do, a progress callback and a cancellation
/// flag.
///
/// Work is cut into chunks whose bounds depend on the problem alone, and partial sums are added in their order: results
/// are the same bytes for any number of threads. One parallel loop runs at a time; loops must not be nested.
class PCL_MRF_EXPORT Execution {
public:
  /// \param threads number of threads, the calling one included; 0 = one per hardware thread. Where the system does not
  /// let so many start, there are fewer.
  explicit Execution(int threads = 1, ProgressCallback progress = {});
  ~Execution();
  Execution(const Execution&) = delete;
  Execution& operator=(const Execution&) = delete;

  int threads() const { return threads_; }

  /// Has parts of a run done as tasks: the finest level in tiles, the remesher's parts. Results are the same bytes
  /// whoever does them. \param tasks outlives this; none: all is done here, at once
  void setTasks(TaskRunner* tasks) { tasks_ = tasks; }
  TaskRunner* tasks() const { return tasks_; }

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
  TaskRunner* tasks_ = nullptr;
};

} // namespace pcl::mrf

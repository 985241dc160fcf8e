// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Threads, progress, cancellation and tasks: the object that every stage gets besides its input and options.
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

/// Called with the name of the running stage and the done fraction of the whole run, 0..1, which never falls; if a
/// stage is called alone, with the fraction of that stage. Returning false cancels the run. Called up to thousands of
/// times a second, always from the thread that runs the reconstruction.
using ProgressCallback = std::function<bool(const std::string& stage, double fraction)>;

/// A stage of a run and its expected seconds. Only the ratios between stages count, except for the first stage.
struct ExpectedStage {
  std::string stage;
  double seconds = 0;
};

class Execution;

/// Runs tasks: parts of a run whose input and output are bytes, so that other processes can run them and their results
/// can be stored. \see TaskDirectory, tasksOfRanks
class PCL_MRF_EXPORT TaskRunner {
public:
  /// Makes the input of a task just before it runs, in ascending order; nothing if the task need not run.
  using MakeInput = std::function<std::optional<std::string>(int task)>;
  /// Receives the result of a task, in ascending order; empty if there was no input.
  using UseResult = std::function<void(int task, std::string result)>;

  virtual ~TaskRunner() = default;

  /// Runs `count` tasks of a kind. \throw what a task throws; Cancelled; ResourceLimit
  virtual void run(const std::string& kind, int count, const MakeInput& makeInput, const UseResult& useResult,
                   Execution& execution) = 0;
};

/// Stores the results of tasks in files of a directory, so that an interrupted run can be resumed. A file is named by
/// the checksum of its task's input and contains its own checksum; a task whose file does not match runs again.
/// \param inner runs the tasks; null: this process does, one after the other
/// \throw FileError if the directory cannot be made, or has results of an earlier run and `resume` is not set
class PCL_MRF_EXPORT TaskDirectory : public TaskRunner {
public:
  TaskDirectory(std::string directory, bool resume, TaskRunner* inner = nullptr);
  ~TaskDirectory() override;

  /// \throw ResourceLimit if there is not enough room for the results, or they cannot be written or change meanwhile
  void run(const std::string& kind, int count, const MakeInput& makeInput, const UseResult& useResult,
           Execution& execution) override;

  /// Number of results that were found, and that were computed.
  int found() const { return found_; }
  int made() const { return made_; }

  /// The memory limit that the tasks depend on, in bytes: the one in the journal, which is that of the run whose
  /// results are here. \param now the limit of this run; it is noted in the journal if there is none
  std::size_t memory(std::size_t now);

  /// Removes the results of this run, which are not needed anymore, and the directory if it was made for it.
  void remove();

private:
  void requireRoom(const std::string& kind, double bytes) const;
  bool append(const std::string& line);
  void note(const std::string& line);

  std::string directory_;
  TaskRunner* inner_;
  bool isOwn_ = false;            ///< the directory was made for the results
  bool hasResults_ = false;       ///< the journal names some
  int journal_ = -1;              ///< descriptor of the journal, a locked file
  std::size_t memory_ = 0;        ///< memory limit in the journal; 0: none yet
  std::vector<std::string> used_; ///< files of results of this run
  int found_ = 0, made_ = 0;
};

/// A runner for the processes that mpirun started. Rank 0 runs the reconstruction and gives tasks to all ranks; the
/// ranks on one machine share the threads of its Execution. On the other ranks this function runs tasks until rank 0's
/// runner is destroyed, and returns null. \throw ResourceLimit if libpcl_mrf_mpi cannot be loaded
PCL_MRF_EXPORT std::unique_ptr<TaskRunner> tasksOfRanks();

/// A fixed set of worker threads, a progress callback and a cancellation flag. Idle threads sleep.
///
/// The bounds of chunks of work depend only on the problem, and partial sums are added in order: results are the same
/// bytes for any number of threads. One parallel loop runs at a time; loops must not be nested.
class PCL_MRF_EXPORT Execution {
public:
  /// \param threads the calling one included; 0 = one per hardware thread; fewer if the system does not let so many
  /// start
  explicit Execution(int threads = 1, ProgressCallback progress = {});
  ~Execution();
  Execution(const Execution&) = delete;
  Execution& operator=(const Execution&) = delete;

  int threads() const { return threads_; }

  /// Runs parts of a reconstruction as tasks: the tiles of the finest level, the parts of the remesher. The results are
  /// the same bytes with any runner. \param tasks must outlive this; null: no tasks
  void setTasks(TaskRunner* tasks) { tasks_ = tasks; }
  TaskRunner* tasks() const { return tasks_; }

  /// Calls body(begin, end) on consecutive ranges of at most `grain` indices that cover [0, count). Ranges run
  /// concurrently. An exception in one of them is rethrown here after all have stopped.
  void forRange(std::int64_t count, std::int64_t grain,
                const std::function<void(std::int64_t begin, std::int64_t end)>& body);

  /// Sum of body(begin, end) over the ranges of forRange, added in order in double precision.
  double sum(std::int64_t count, std::int64_t grain,
             const std::function<double(std::int64_t begin, std::int64_t end)>& body);

  /// Begins a run of several stages in this order. The callback then receives the fraction of all stages, also from
  /// forRange. A stage that does not run counts as done; an unexpected stage does not count.
  void beginRun(std::vector<ExpectedStage> stages);

  /// Ends the run and reports the fraction 1. \throw Cancelled if the callback returns false
  void endRun();

  /// Begins a stage and reports progress; for a stage outside of a run, the fraction 0.
  void beginStage(const std::string& name);

  /// Maps the following fractions 0..1 to the part [from, to] of the stage: a solver need not know that it is one of
  /// many.
  void beginStep(double from, double to);

  /// Reports the done fraction of the current step, 0..1. The fraction that the callback receives never falls inside a
  /// stage or a run. \throw Cancelled if the callback returns false
  void progress(double fraction);

  /// Reports progress again, so that the callback can cancel a step that does not know its fraction.
  void poll();

private:
  struct Workers;
  class Run;

  /// Called inside a loop: reports if the last report is some time ago. \throw Cancelled
  void tick();

  int threads_;
  ProgressCallback callback_;
  std::string stage_;
  double fraction_ = 0, stepBegin_ = 0, stepEnd_ = 1;
  std::chrono::steady_clock::time_point lastCall_;
  std::unique_ptr<Run> run_; ///< null: stages are called alone
  std::unique_ptr<Workers> workers_;
  TaskRunner* tasks_ = nullptr;
};

} // namespace pcl::mrf

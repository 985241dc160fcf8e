// SPDX-License-Identifier: BSD-3-Clause
#ifdef __linux__
#include <sched.h>
#endif
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/execution.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

namespace pcl::mrf {
namespace {

/// Maximum fraction of a stage from a report: a report of 1 does not mean that the stage ends.
constexpr double largestReport = .95;

/// Time that a thread waits for work before it sleeps.
constexpr std::chrono::microseconds timeAwake{50};

} // namespace

/// Workers wait until the loop counter changes, then claim ranges until none is left. A loop waits for the workers that
/// began with it, not for workers that are still waking up.
struct Execution::Workers {
  std::mutex mutex;
  std::condition_variable wake, done;
  std::vector<std::thread> threads;
  std::atomic<std::uint64_t> loop{0};
  std::atomic<int> running{0}; ///< workers that have begun with the loop
  bool isOpen = false;         ///< workers may begin with the loop
  bool stop = false;

  const std::function<void(std::int64_t, std::int64_t)>* body = nullptr;
  std::int64_t count = 0, grain = 1;
  std::atomic<std::int64_t> next{0};
  std::exception_ptr error;

  /// If a thread cannot be started, because of a limit of the system or of memory, there are no more threads.
  explicit Workers(int number) noexcept
  {
    try {
      for (int i = 0; i < number; ++i)
        threads.emplace_back([this] { serve(); });
    } catch (...) {
    }
  }

  ~Workers()
  {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      stop = true;
    }
    wake.notify_all();
    for (std::thread& thread : threads)
      thread.join();
  }

  /// \param after called after each range
  template <typename After>
  void claimRanges(const After& after)
  {
    try {
      for (std::int64_t begin = next.fetch_add(grain); begin < count; begin = next.fetch_add(grain)) {
        (*body)(begin, std::min(begin + grain, count));
        after();
      }
    } catch (...) {
      next = count;
      const std::lock_guard<std::mutex> lock(mutex);
      if (!error)
        error = std::current_exception();
    }
  }

  /// Waits awake for a short time, because to be woken takes as long as a short loop.
  template <typename Condition>
  static void stayAwakeUntil(const Condition& condition)
  {
    const auto end = std::chrono::steady_clock::now() + timeAwake;
    while (!condition() && std::chrono::steady_clock::now() < end)
      std::this_thread::yield();
  }

  void serve()
  {
    std::uint64_t served = 0;
    for (;;) {
      stayAwakeUntil([&] { return loop != served; });
      std::unique_lock<std::mutex> lock(mutex);
      wake.wait(lock, [&] { return stop || loop != served; });
      if (stop)
        return;
      served = loop;
      if (!isOpen)
        continue;
      ++running;
      lock.unlock();
      claimRanges([] {});
      lock.lock();
      if (--running == 0)
        done.notify_one();
    }
  }

  /// \param after called after each range of the calling thread
  template <typename After>
  void run(std::int64_t loopCount, std::int64_t loopGrain,
           const std::function<void(std::int64_t, std::int64_t)>& loopBody, const After& after)
  {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      body = &loopBody;
      count = loopCount;
      grain = loopGrain;
      next = 0;
      error = nullptr;
      isOpen = true;
      ++loop;
    }
    wake.notify_all();
    claimRanges(after);
    std::unique_lock<std::mutex> lock(mutex);
    isOpen = false;
    lock.unlock();
    stayAwakeUntil([&] { return running == 0; });
    lock.lock();
    done.wait(lock, [&] { return running == 0; });
    if (error)
      std::rethrow_exception(error);
  }
};

/// The done fraction of a run: from the reports of the stages, and from the time between reports.
class Execution::Run {
public:
  using Clock = std::chrono::steady_clock;

  explicit Run(std::vector<ExpectedStage> stages) : stages_(std::move(stages))
  {
    for (const ExpectedStage& stage : stages_)
      total_ += stage.seconds;
  }

  void beginStage(const std::string& name)
  {
    std::size_t next = at_;
    while (next < stages_.size() && stages_[next].stage != name)
      ++next;
    expected_ = 0;
    if (next == stages_.size()) // unexpected stage: only the stage before it is done
      done_ += isExpected_ ? stages_[at_++].seconds : 0;
    else {
      for (; at_ < next; ++at_)
        done_ += stages_[at_].seconds;
      expected_ = stages_[at_].seconds;
    }
    isExpected_ = next < stages_.size();
    begin_ = reported_ = Clock::now();
    shown_ = 0;
    // Scales by the speed of the machine: past time over expected time. Short expected times count less, by `trust`.
    const double trust = .25 * total_;
    remaining_ = expected_ * (secondsBetween(start_, begin_) + trust) / (done_ + trust);
  }

  /// \param fraction of the stage
  void report(double fraction)
  {
    shown_ = std::max(inStage(), std::min(fraction, largestReport));
    reported_ = Clock::now();
    if (fraction > 0)
      remaining_ = secondsBetween(begin_, reported_) * (1 - std::min(fraction, largestReport)) / fraction;
  }

  /// The fraction of the run.
  double fraction()
  {
    if (total_ > 0)
      fraction_ = std::max(fraction_, std::min((done_ + expected_ * inStage()) / total_, 1.));
    return fraction_;
  }

private:
  static double secondsBetween(Clock::time_point begin, Clock::time_point end)
  {
    return std::chrono::duration<double>(end - begin).count();
  }

  /// The fraction of the stage, by the time since its last report: grows steadily for half of the expected remaining
  /// time, then ever more slowly, but never stops.
  double inStage() const
  {
    constexpr double steady = .5;
    const double time = remaining_ > 0 ? secondsBetween(reported_, Clock::now()) / remaining_ : 0;
    const double share = time < steady ? time : 1 - (1 - steady) * (1 - steady) / (time + 1 - 2 * steady);
    return shown_ + (1 - shown_) * share;
  }

  std::vector<ExpectedStage> stages_;
  std::size_t at_ = 0; ///< the running stage if it is expected, else the next expected one
  bool isExpected_ = false;
  double total_ = 0, done_ = 0, expected_ = 0; ///< expected seconds of all stages, of the done ones, of the running one
  double shown_ = 0;                           ///< fraction of the stage at its last report
  double remaining_ = 0;                       ///< expected seconds of the stage from then on
  double fraction_ = 0;
  Clock::time_point start_ = Clock::now(), begin_ = start_, reported_ = start_;
};

namespace {

/// Processors that this process may use: hardware_concurrency() counts all, also those that taskset, a container's
/// cpuset or a batch system took away.
int usableProcessors()
{
#ifdef __linux__
  cpu_set_t usable;
  if (sched_getaffinity(0, sizeof(usable), &usable) == 0)
    return std::max(1, CPU_COUNT(&usable));
#endif
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

} // namespace

Execution::Execution(int threads, ProgressCallback progress) : threads_(threads), callback_(std::move(progress))
{
  if (threads_ <= 0)
    threads_ = usableProcessors();
  if (threads_ > 1) {
    workers_ = std::make_unique<Workers>(threads_ - 1);
    threads_ = 1 + static_cast<int>(workers_->threads.size());
  }
}

Execution::~Execution() = default;

void Execution::forRange(std::int64_t count, std::int64_t grain,
                         const std::function<void(std::int64_t begin, std::int64_t end)>& body)
{
  grain = std::max<std::int64_t>(grain, 1);
  if (workers_ && count > grain) {
    workers_->run(count, grain, body, [this] { tick(); });
    return;
  }
  for (std::int64_t begin = 0; begin < count; begin += grain) {
    body(begin, std::min(begin + grain, count));
    tick();
  }
}

double Execution::sum(std::int64_t count, std::int64_t grain,
                      const std::function<double(std::int64_t begin, std::int64_t end)>& body)
{
  grain = std::max<std::int64_t>(grain, 1);
  std::vector<double> partial((count + grain - 1) / grain);
  forRange(count, grain, [&](std::int64_t begin, std::int64_t end) { partial[begin / grain] = body(begin, end); });
  double total = 0;
  for (const double value : partial)
    total += value;
  return total;
}

void Execution::beginRun(std::vector<ExpectedStage> stages)
{
  run_ = std::make_unique<Run>(std::move(stages));
}

void Execution::endRun()
{
  if (!run_)
    return;
  run_.reset();
  fraction_ = 1;
  poll();
}

void Execution::beginStage(const std::string& name)
{
  stage_ = name;
  fraction_ = 0;
  beginStep(0, 1);
  if (run_)
    run_->beginStage(name);
  poll();
}

void Execution::beginStep(double from, double to)
{
  stepBegin_ = from;
  stepEnd_ = to;
}

void Execution::progress(double fraction)
{
  const double reported = stepBegin_ + (stepEnd_ - stepBegin_) * std::min(std::max(fraction, 0.), 1.);
  if (run_ && reported > fraction_)
    run_->report(reported);
  fraction_ = std::max(fraction_, reported);
  poll();
}

void Execution::poll()
{
  if (!callback_)
    return;
  lastCall_ = std::chrono::steady_clock::now();
  const double fraction = run_ ? run_->fraction() : fraction_;
  if (!callHandedIn("the progress callback", [&] { return callback_(stage_, fraction); }))
    throw Cancelled("cancelled during the stage '" + stage_ + "'");
}

void Execution::tick()
{
  constexpr std::chrono::milliseconds pause(50);
  if (run_ && callback_ && std::chrono::steady_clock::now() - lastCall_ >= pause)
    poll();
}

} // namespace pcl::mrf

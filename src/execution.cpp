#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/execution.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace pcl {
namespace mrf {

const char* toString(Status status)
{
  switch (status) {
  case Status::ok:
    return "ok";
  case Status::invalidInput:
    return "invalid input";
  case Status::invalidOption:
    return "invalid option";
  case Status::resourceLimit:
    return "resource limit";
  case Status::solverFailure:
    return "solver failure";
  case Status::cancelled:
    return "cancelled";
  case Status::internalError:
    return "internal error";
  }
  return "unknown";
}

/// Workers wait for the loop counter to move, then claim ranges until none is left.
struct Execution::Workers {
  std::mutex mutex;
  std::condition_variable wake, done;
  std::vector<std::thread> threads;
  std::uint64_t loop = 0;
  int running = 0;
  bool stop = false;

  const std::function<void(std::int64_t, std::int64_t)>* body = nullptr;
  std::int64_t count = 0, grain = 1;
  std::atomic<std::int64_t> next{0};
  std::exception_ptr error;

  /// A thread that cannot be started (a limit of the system or of memory) is done without, and so are those after it.
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

  void claimRanges()
  {
    try {
      for (std::int64_t begin = next.fetch_add(grain); begin < count; begin = next.fetch_add(grain))
        (*body)(begin, std::min(begin + grain, count));
    } catch (...) {
      next = count;
      const std::lock_guard<std::mutex> lock(mutex);
      if (!error)
        error = std::current_exception();
    }
  }

  void serve()
  {
    std::uint64_t served = 0;
    std::unique_lock<std::mutex> lock(mutex);
    for (;;) {
      wake.wait(lock, [&] { return stop || loop != served; });
      if (stop)
        return;
      served = loop;
      lock.unlock();
      claimRanges();
      lock.lock();
      if (--running == 0)
        done.notify_one();
    }
  }

  void run(std::int64_t loopCount, std::int64_t loopGrain,
           const std::function<void(std::int64_t, std::int64_t)>& loopBody)
  {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      body = &loopBody;
      count = loopCount;
      grain = loopGrain;
      next = 0;
      error = nullptr;
      running = static_cast<int>(threads.size());
      ++loop;
    }
    wake.notify_all();
    claimRanges();
    std::unique_lock<std::mutex> lock(mutex);
    done.wait(lock, [&] { return running == 0; });
    if (error)
      std::rethrow_exception(error);
  }
};

Execution::Execution(int threads, ProgressCallback progress) : threads_(threads), callback_(std::move(progress))
{
  if (threads_ <= 0)
    threads_ = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
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
    workers_->run(count, grain, body);
    return;
  }
  for (std::int64_t begin = 0; begin < count; begin += grain)
    body(begin, std::min(begin + grain, count));
}

double Execution::sum(std::int64_t count, std::int64_t grain,
                      const std::function<double(std::int64_t begin, std::int64_t end)>& body)
{
  grain = std::max<std::int64_t>(grain, 1);
  std::vector<double> partial(static_cast<std::size_t>((count + grain - 1) / grain));
  forRange(count, grain, [&](std::int64_t begin, std::int64_t end) {
    partial[static_cast<std::size_t>(begin / grain)] = body(begin, end);
  });
  double total = 0;
  for (const double value : partial)
    total += value;
  return total;
}

void Execution::beginStage(const std::string& name)
{
  stage_ = name;
  fraction_ = 0;
  beginStep(0, 1);
  poll();
}

void Execution::beginStep(double from, double to)
{
  stepBegin_ = from;
  stepEnd_ = to;
}

void Execution::progress(double fraction)
{
  fraction_ = std::max(fraction_, stepBegin_ + (stepEnd_ - stepBegin_) * std::min(std::max(fraction, 0.), 1.));
  poll();
}

void Execution::poll()
{
  if (callback_ && !callback_(stage_, fraction_))
    throw Cancelled("cancelled during the stage '" + stage_ + "'");
}

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
#include "support/threads.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/execution.h>

#include <gtest/gtest.h>

#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <thread>
#include <vector>

using namespace pcl::mrf;

TEST(Execution, SumIsTheSameForAnyNumberOfThreads)
{
  sameOnAnyThreads([](int threads) {
    Execution execution(threads);
    return execution.sum(100000, 1000, [](std::int64_t begin, std::int64_t end) {
      double sum = 0;
      for (auto i = begin; i < end; ++i)
        sum += std::sin(static_cast<double>(i)) * std::exp(static_cast<double>(i % 50));
      return sum;
    });
  });
}

TEST(Execution, TakesTheProcessorsThatTheProcessMayUse)
{
  cpu_set_t before, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof(before), &before), 0);
  CPU_ZERO(&one);
  for (int cpu = 0; CPU_COUNT(&one) == 0; ++cpu)
    if (CPU_ISSET(cpu, &before))
      CPU_SET(cpu, &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
  const int threads = Execution(0).threads();
  sched_setaffinity(0, sizeof(before), &before);
  EXPECT_EQ(threads, 1);
  EXPECT_EQ(Execution(0).threads(), CPU_COUNT(&before));
}

TEST(Execution, RethrowsAnExceptionOfTheBodyAndGoesOnWorking)
{
  for (const int threads : {1, 3}) {
    Execution execution(threads);
    const auto failing = [](std::int64_t begin, std::int64_t) {
      if (begin == 50)
        throw std::runtime_error("range 50");
    };
    EXPECT_THROW(execution.forRange(100, 1, failing), std::runtime_error);
    std::atomic<int> visited{0};
    execution.forRange(100, 1, [&](std::int64_t, std::int64_t) { ++visited; });
    EXPECT_EQ(visited, 100);
  }
}

TEST(Execution, ReportsStagesAndCancels)
{
  std::vector<std::pair<std::string, double>> calls;
  Execution execution(2, [&](const std::string& stage, double fraction) {
    calls.emplace_back(stage, fraction);
    return fraction < .9;
  });
  execution.beginStage("first");
  execution.progress(.5);
  EXPECT_THROW(execution.progress(1), Cancelled);
  ASSERT_EQ(calls.size(), 3u);
  EXPECT_EQ(calls[0], std::make_pair(std::string("first"), 0.0));
  EXPECT_EQ(calls[1], std::make_pair(std::string("first"), .5));
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) // they reserve terabytes of addresses
TEST(Execution, GoesOnWithTheThreadsThatStart)
{
  rlimit unlimited{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &unlimited), 0);
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  ASSERT_GT(pages, 0u);
  // Room for the stacks of a few threads, which are megabytes each.
  rlimit limited = unlimited;
  limited.rlim_cur = pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + (std::size_t{64} << 20);
  constexpr int wanted = 200;
  ASSERT_EQ(setrlimit(RLIMIT_AS, &limited), 0);
  std::atomic<int> visited{0};
  int threads = 0;
  {
    Execution execution(wanted);
    threads = execution.threads();
    execution.forRange(1000, 1, [&](std::int64_t, std::int64_t) { ++visited; });
  }
  ASSERT_EQ(setrlimit(RLIMIT_AS, &unlimited), 0);
  EXPECT_GE(threads, 1);
  EXPECT_LT(threads, wanted);
  EXPECT_EQ(visited, 1000);
  EXPECT_EQ(Execution(3).threads(), 3);
}
#endif

TEST(Execution, ProgressNeverFallsInsideAStage)
{
  std::vector<double> seen;
  Execution execution(1, [&](const std::string&, double fraction) { return seen.push_back(fraction), true; });
  execution.beginStage("levels");
  execution.beginStep(0, .25);
  execution.progress(.5);
  execution.progress(1);
  execution.beginStep(.25, 1);
  execution.progress(0);
  execution.progress(2. / 3);
  execution.progress(.1);
  execution.poll();
  execution.beginStage("next");
  execution.progress(.5);
  EXPECT_EQ(seen, (std::vector<double>{0, .125, .25, .25, .75, .75, .75, 0, .5}));
}

namespace {

/// The calls of a callback.
struct Calls {
  std::vector<std::string> stages;
  std::vector<double> fractions;

  ProgressCallback callback()
  {
    return [this](const std::string& stage, double fraction) {
      stages.push_back(stage);
      fractions.push_back(fraction);
      return true;
    };
  }
};

/// Work that is slow enough for several progress calls during a loop of it.
void pauseABit(std::int64_t, std::int64_t)
{
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
}

} // namespace

TEST(Execution, ARunHasOneFraction)
{
  Calls calls;
  Execution execution(1, calls.callback());
  execution.beginRun({{"first", 1000}, {"left out", 2000}, {"second", 5000}, {"third", 2000}});
  // What the time adds in these microseconds is far less than this.
  constexpr double tolerance = 1e-3;
  const auto expect = [&](double fraction) { EXPECT_NEAR(calls.fractions.back(), fraction, tolerance); };
  // Half a stage in microseconds lets expect the rest in no time.
  const auto expectBetween = [&](double lower, double upper) {
    EXPECT_GE(calls.fractions.back(), lower);
    EXPECT_LE(calls.fractions.back(), upper);
  };
  execution.beginStage("first");
  expect(0);
  execution.progress(.5);
  expectBetween(.05, .1);
  execution.beginStage("second");
  expect(.3);
  execution.beginStep(0, .5);
  execution.progress(1);
  expectBetween(.55, .8);
  execution.beginStage("not expected");
  expect(.8);
  execution.progress(1);
  expect(.8);
  execution.beginStage("third");
  expect(.8);
  execution.beginStage("second");
  expect(1);
  execution.endRun();
  EXPECT_EQ(calls.fractions.back(), 1);
  EXPECT_TRUE(std::is_sorted(calls.fractions.begin(), calls.fractions.end()));
  execution.beginRun({{"first", 1}});
  execution.beginStage("first");
  expect(0);
}

TEST(Execution, TheFractionOfARunNeverStandsStill)
{
  for (const int threads : {1, 2}) {
    Calls calls;
    Execution execution(threads, calls.callback());
    // As expected, and far slower than that; without reports, and with a report that promises too much.
    for (const double seconds : {.5, 1e-3})
      for (const bool reports : {false, true}) {
        calls = {};
        execution.beginRun({{"first", seconds}, {"second", 9 * seconds}});
        execution.beginStage("first");
        if (reports)
          execution.progress(1);
        const std::size_t before = calls.fractions.size();
        execution.forRange(16 * threads, 1, pauseABit); // half a second
        ASSERT_GE(calls.fractions.size(), before + 4) << "several times a second";
        for (std::size_t i = before; i < calls.fractions.size(); ++i)
          EXPECT_GT(calls.fractions[i], calls.fractions[i - 1]) << "expected " << seconds << ", reports " << reports;
        EXPECT_LT(calls.fractions.back(), .1) << "the stage is not done";
        execution.beginStage("second");
        // How far beyond depends on how long this thread has waited, of the milliseconds that are expected.
        EXPECT_GT(calls.fractions.back(), .1 - 1e-9) << "the stage is done";
      }
  }
}

TEST(Execution, ARunCanBeCancelledInsideALoop)
{
  for (const int threads : {1, 3}) {
    bool goesOn = true;
    Execution execution(threads, [&](const std::string&, double) { return goesOn; });
    execution.beginRun({{"first", 1}});
    execution.beginStage("first");
    goesOn = false;
    std::atomic<int> ranges{0};
    const auto body = [&](std::int64_t begin, std::int64_t end) {
      ++ranges;
      pauseABit(begin, end);
    };
    EXPECT_THROW(execution.forRange(1000, 1, body), Cancelled);
    EXPECT_LT(ranges, 50);
    goesOn = true;
    execution.forRange(10, 1, body); // it works after that
  }
}

TEST(Execution, LoopsOfAStageAloneDoNotCall)
{
  Calls calls;
  Execution execution(1, calls.callback());
  execution.beginStage("alone");
  execution.forRange(5, 1, pauseABit);
  EXPECT_EQ(calls.fractions.size(), 1u);
}

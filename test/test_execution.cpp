#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/execution.h>

#include <gtest/gtest.h>

#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <vector>

using namespace pcl::mrf;

TEST(Execution, VisitsEveryIndexOnce)
{
  for (const int threads : {1, 2, 4}) {
    Execution execution(threads);
    for (const std::int64_t count : {0, 1, 7, 64, 1001}) {
      std::vector<std::atomic<int>> visits(static_cast<std::size_t>(count));
      execution.forRange(count, 8, [&](std::int64_t begin, std::int64_t end) {
        EXPECT_LE(end - begin, 8);
        for (auto i = begin; i < end; ++i)
          ++visits[static_cast<std::size_t>(i)];
      });
      for (const auto& visit : visits)
        EXPECT_EQ(visit, 1);
    }
  }
}

TEST(Execution, SumIsTheSameForAnyNumberOfThreads)
{
  const auto term = [](std::int64_t i) {
    return std::sin(static_cast<double>(i)) * std::exp(static_cast<double>(i % 50));
  };
  const auto total = [&](int threads) {
    Execution execution(threads);
    return execution.sum(100000, 1000, [&](std::int64_t begin, std::int64_t end) {
      double sum = 0;
      for (auto i = begin; i < end; ++i)
        sum += term(i);
      return sum;
    });
  };
  const double one = total(1);
  for (int run = 0; run < 5; ++run) {
    EXPECT_EQ(total(2), one);
    EXPECT_EQ(total(4), one);
  }
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

TEST(Execution, TakesOneThreadPerHardwareThreadByDefault)
{
  EXPECT_GE(Execution(0).threads(), 1);
  EXPECT_EQ(Execution(3).threads(), 3);
}

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

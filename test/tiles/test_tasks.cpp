// SPDX-License-Identifier: BSD-3-Clause
#include "levels/multiscale.h"
#include "mesh/mesh_topology.h"
#include "remesher/remesher.h"
#include "support/clouds.h"
#include "support/meshes.h"
#include "support/shapes.h"
#include "tiles/do_task.h"
#include "tiles/ranks.h"

#include <pcl/surface/mrf/exceptions.h>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <deque>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

using namespace meshes;
using namespace pcl::mrf;

namespace {

namespace fs = std::filesystem;

/// The result of the work that tasks do: levels, the finest in tiles, and a mesh remeshed in parts.
struct Outcome {
  std::vector<float> distances;
  TriangleMesh mesh;
  int tiles = 0, iterations = 0;
};

/// \param sizes a growth of the edges in an open mesh, or none
Outcome outcomeOf(const PointSet& points, float spacing, const EdgeSizing& sizes, TaskRunner* tasks, int threads = 1)
{
  Execution execution(threads);
  execution.setTasks(tasks);
  const OrientedPoints oriented = shapes::oriented(points);
  const auto search = clouds::searchOf(points);
  Options options;
  options.multiscale.denseVoxels = 5000;
  options.solver.smootherDegree = sizes.empty() ? 0 : 3;
  MultiscaleResult levels =
      regularize({&oriented, search.get(), boundingBox(oriented.positions)}, spacing, options, execution, 4);
  TriangleMesh raw = polygonize(levels.field, execution);
  Outcome result;
  result.tiles = levels.levels.back().tiles;
  result.iterations = levels.levels.back().solve.iterations;
  for (const Eigen::Vector3f& vertex : raw.vertices)
    result.distances.push_back(levels.field.sampleDistance(1.01f * vertex));
  EdgeSizing sizing;
  if (!sizes.empty()) { // of an open mesh
    raw = selectWhere(raw, [](const Eigen::Vector3f& p) { return p.x() < .25f; });
    splitFans(raw);
    for (const Eigen::Vector3f& vertex : raw.vertices)
      sizing.push_back(vertex.z() > 0 ? 1 + sizes.front() * vertex.z() : 1);
  }
  result.mesh = remesh(raw, levels.field, sizing, options.remesher, execution, 4000).mesh;
  return result;
}

Outcome outcome(TaskRunner* tasks, int threads = 1)
{
  return outcomeOf(shapes::sample(shapes::torus(1, .4), 1.6, .03), .03f, {}, tasks, threads);
}

/// With all that tasks may depend on: a sheet that was missed at first, borders, edges of several lengths.
Outcome outcomeOfPlate(TaskRunner* tasks)
{
  PointSet points = shapes::sample(shapes::box({.5, .02, 1}), 1.2, .015);
  shapes::addNoise(points, .03);
  return outcomeOf(points, .015f, {.5f}, tasks);
}

void expectSame(const Outcome& here, const Outcome& there)
{
  EXPECT_EQ(here.tiles, there.tiles);
  EXPECT_EQ(here.iterations, there.iterations);
  EXPECT_EQ(here.distances, there.distances);
  meshes::expectSame(here.mesh, there.mesh);
}

const Outcome& atOnce()
{
  static const Outcome result = outcome(nullptr);
  return result;
}

/// A temporary directory of a test.
class Directory {
public:
  Directory() { fs::remove_all(path()); }
  ~Directory() { fs::remove_all(path()); }

  std::string path() const
  {
    return testing::TempDir() + "tasks-" + testing::UnitTest::GetInstance()->current_test_info()->name();
  }
  std::vector<fs::path> results() const
  {
    std::vector<fs::path> all;
    for (const auto& entry : fs::directory_iterator(path()))
      if (entry.path().extension() == ".result")
        all.push_back(entry.path());
    return all;
  }
};

/// Expects the call to throw an error of this type with these words.
template <typename Refusal, typename Call>
void expectRefused(const Call& call, const std::string& words)
{
  try {
    call();
    FAIL() << "nothing was thrown that says: " << words;
  } catch (const Refusal& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

/// Messages between threads that act as ranks.
namespace mail {

struct Letter {
  int from, tag;
  std::string bytes;
};
constexpr int ranks = 3;
std::mutex mutex;
std::deque<Letter> boxes[ranks];
int finished = 0;
thread_local int rank = 0;

void send(std::int32_t to, std::int32_t tag, const void* bytes, std::uint64_t count)
{
  const std::lock_guard<std::mutex> lock(mutex);
  boxes[to].push_back({rank, tag, std::string(static_cast<const char*>(bytes), count)});
}

std::int32_t probe(Message* message)
{
  const std::lock_guard<std::mutex> lock(mutex);
  if (boxes[rank].empty())
    return 0;
  const Letter& letter = boxes[rank].front();
  *message = {letter.from, letter.tag, letter.bytes.size()};
  return 1;
}

void receive(const Message* message, void* bytes)
{
  const std::lock_guard<std::mutex> lock(mutex);
  std::memcpy(bytes, boxes[rank].front().bytes.data(), message->bytes);
  boxes[rank].pop_front();
}

void finish()
{
  const std::lock_guard<std::mutex> lock(mutex);
  ++finished;
}

} // namespace mail

/// Calls body(runner of rank 0) while all other ranks work.
template <typename Body>
void withRanks(const Body& body)
{
  const auto passingOf = [](int rank) {
    return MessagePassing{rank, mail::ranks, mail::ranks, mail::send, mail::probe, mail::receive, mail::finish};
  };
  mail::finished = 0;
  std::vector<std::thread> others;
  for (int rank = 1; rank < mail::ranks; ++rank)
    others.emplace_back([&passingOf, rank] {
      mail::rank = rank;
      serveRanks(passingOf(rank));
    });
  {
    const MessagePassing own = passingOf(0);
    Ranks ranks(own);
    body(ranks);
  }
  for (std::thread& other : others)
    other.join();
  EXPECT_EQ(mail::finished, mail::ranks);
  for (const auto& box : mail::boxes)
    EXPECT_TRUE(box.empty());
}

} // namespace

TEST(Tasks, AreTheSameFromBytesToBytes)
{
  OneProcess here;
  EXPECT_EQ(atOnce().tiles, 4);
  expectSame(outcome(&here), atOnce());
}

TEST(Tasks, DependOnWhatTheyAreGivenOnly)
{
  OneProcess here;
  const Outcome plate = outcomeOfPlate(nullptr);
  EXPECT_GT(plate.iterations, 1) << "no sheet was missed";
  expectSame(outcomeOfPlate(&here), plate);
}

TEST(Tasks, AreTheSameOnThreeRanksOfAnyThreads)
{
  withRanks([](Ranks& ranks) {
    expectSame(outcome(&ranks), atOnce());
    expectSame(outcome(&ranks, 2 * mail::ranks), atOnce());
  });
}

TEST(Tasks, FailWithTheErrorOfAnyRank)
{
  withRanks([](Ranks& ranks) {
    Execution execution(1);
    // Rank 0 does one of them and waits for none: who is the first to fail does not matter.
    EXPECT_THROW(ranks.run(
                     "none", 5, [](int) { return std::string("input"); },
                     [](int, const std::string&) { FAIL() << "a result of a task that nobody can do"; }, execution),
                 std::exception);
    expectSame(outcome(&ranks), atOnce()); // what was under way is not in the way
  });
}

TEST(Tasks, OfRanksMayBeCancelled)
{
  withRanks([](Ranks& ranks) {
    int calls = 0;
    Execution execution(1, [&](const std::string&, double) { return ++calls < 3; });
    EXPECT_THROW(ranks.run(
                     "tile", 5, [](int) { return std::string("no tile"); }, [](int, const std::string&) {}, execution),
                 std::exception);
    expectSame(outcome(&ranks), atOnce());
  });
}

TEST(Tasks, AreNotDoneByAnotherBuild)
{
  mail::boxes[1].push_back({0, 1, "an earlier version"});
  mail::rank = 1;
  expectRefused<ResourceLimit>(
      [] {
        serveRanks({1, mail::ranks, mail::ranks, mail::send, mail::probe, mail::receive, mail::finish});
      },
      "rank 1 runs another build of the library than rank 0: install the same");
  mail::rank = 0;
}

TEST(TaskDirectory, GoesOnFromWhatIsThere)
{
  const Directory directory;
  int all = 0;
  {
    TaskDirectory tasks(directory.path(), false);
    expectSame(outcome(&tasks), atOnce());
    EXPECT_EQ(tasks.found(), 0);
    all = tasks.made();
    EXPECT_GT(all, 8);
  }
  // Some are lost, one is cut off, one has another byte in it.
  std::vector<fs::path> results = directory.results();
  ASSERT_EQ(results.size(), static_cast<std::size_t>(all));
  fs::remove(results[0]);
  fs::resize_file(results[1], fs::file_size(results[1]) - 1);
  {
    std::fstream file(results[2], std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(100);
    file.put('?');
  }
  // One has another one's place, one is no file.
  fs::copy_file(results[4], results[3], fs::copy_options::overwrite_existing);
  fs::remove(results[5]);
  fs::create_directory(results[5]);
  {
    TaskDirectory tasks(directory.path(), true);
    expectRefused<ResourceLimit>([&] { outcome(&tasks); }, "those before it are kept"); // a folder is a result
  }
  fs::remove(results[5]);
  TaskDirectory tasks(directory.path(), true);
  expectSame(outcome(&tasks), atOnce());
  EXPECT_GE(tasks.made(), 1);
  EXPECT_EQ(tasks.found() + tasks.made(), all);
  tasks.remove();
  EXPECT_FALSE(fs::exists(directory.path()));
}

TEST(TaskDirectory, RemovesNothingElse)
{
  const Directory directory;
  fs::create_directory(directory.path());
  const std::string other = directory.path() + "/tile-0123456789abcdef-1.result", notes = directory.path() + "/notes";
  std::ofstream(notes) << "of someone";
  {
    TaskDirectory tasks(directory.path(), false);
    outcome(&tasks);
    std::ofstream(other) << "of another run";
    tasks.remove();
    EXPECT_EQ(directory.results(), std::vector<fs::path>{other});
  }
  fs::remove(other);
  TaskDirectory tasks(directory.path(), true);
  tasks.remove();
  EXPECT_EQ(fs::file_size(notes), 10u);
  fs::remove(notes);
  EXPECT_TRUE(fs::is_empty(directory.path())) << "which was there before";
}

TEST(TaskDirectory, KeepsTheMemoryThatItsTasksAreCutBy)
{
  const Directory directory;
  {
    TaskDirectory tasks(directory.path(), false);
    EXPECT_EQ(tasks.memory(3000), 3000u);
    EXPECT_EQ(tasks.memory(2000), 3000u) << "of the run's beginning";
  }
  EXPECT_FALSE(fs::exists(directory.path())) << "without results";
  {
    TaskDirectory tasks(directory.path(), false);
    tasks.memory(5000);
    outcome(&tasks);
  }
  TaskDirectory tasks(directory.path(), true);
  EXPECT_EQ(tasks.memory(7000), 5000u);
  outcome(&tasks);
  tasks.remove();
  EXPECT_FALSE(fs::exists(directory.path()));
}

TEST(TaskDirectory, RemovesWhatAKilledRunWasWriting)
{
  const Directory directory;
  {
    TaskDirectory tasks(directory.path(), false);
    outcome(&tasks);
  }
  std::ofstream(directory.results().front().string() + ".123.part") << "half a result";
  std::ofstream(directory.path() + "/of.someone.123.part") << "something else";
  TaskDirectory tasks(directory.path(), true);
  outcome(&tasks);
  tasks.remove();
  EXPECT_TRUE(fs::remove(directory.path() + "/of.someone.123.part"));
  EXPECT_TRUE(fs::is_empty(directory.path())) << "half a result is left behind";
}

TEST(TaskDirectory, IsKnownForItsOwnBeforeItHasResults)
{
  const Directory directory;
  const std::string copy = directory.path() + ".copy";
  {
    const TaskDirectory killed(directory.path(), false);
    fs::copy(directory.path(), copy); // as a run leaves it that is killed now
  }
  EXPECT_FALSE(fs::exists(directory.path()));
  {
    TaskDirectory tasks(copy, false); // there is nothing to resume
    outcome(&tasks);
    tasks.remove();
  }
  EXPECT_FALSE(fs::exists(copy));
}

TEST(TaskDirectory, IsOfOneRun)
{
  const Directory directory;
  {
    TaskDirectory first(directory.path(), false);
    expectRefused<FileError>([&] { TaskDirectory(directory.path(), true); }, "in use by another run");
  }
  EXPECT_FALSE(fs::exists(directory.path())) << "without results";
  {
    TaskDirectory first(directory.path(), false);
    outcome(&first);
  }
  expectRefused<FileError>([&] { TaskDirectory(directory.path(), false); }, "go on with it (--resume)");
  const TaskDirectory second(directory.path(), true);
}

TEST(TaskDirectory, WithoutRoomKeepsWhatWasWritten)
{
  const Directory directory;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto former = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  {
    TaskDirectory tasks(directory.path(), false);
    outcome(&tasks);
    std::string name;
    std::size_t first = 0, largest = 0, size = 0;
    for (std::ifstream journal(directory.path() + "/pcl_mrf_journal.txt"); journal >> name >> size;) {
      first = first == 0 ? size : first;
      largest = std::max(largest, size);
    }
    ASSERT_LT(first + 8, largest);
    small.rlim_cur = first + 8; // with its checksum
    tasks.remove();
  }
  {
    TaskDirectory tasks(directory.path(), false);
    setrlimit(RLIMIT_FSIZE, &small);
    expectRefused<ResourceLimit>([&] { outcome(&tasks); }, "make room");
    setrlimit(RLIMIT_FSIZE, &before);
  }
  std::signal(SIGXFSZ, former);
  for (const auto& entry : fs::directory_iterator(directory.path()))
    EXPECT_NE(entry.path().extension(), ".part") << "half a file";
  TaskDirectory tasks(directory.path(), true);
  expectSame(outcome(&tasks), atOnce());
  EXPECT_GT(tasks.found(), 0);
}

TEST(TaskDirectory, TellsWhereItCannotBe)
{
  const Directory directory;
  std::ofstream(directory.path()) << "a file";
  expectRefused<FileError>([&] { TaskDirectory(directory.path(), false); },
                           directory.path() + "' cannot be written to");
}

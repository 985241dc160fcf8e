// SPDX-License-Identifier: BSD-3-Clause
// Faults outside of the method, in memory, threads and the user's own objects, give a clean error.
#include "support/clouds.h"
#include "support/contract.h"

#include "base/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <new>
#include <stdexcept>

using namespace contract;
using conversion::sameBytes;
using pcl::mrf::Status;

// Eigen's sparse matrices leak memory when an allocation in their constructor fails.
extern "C" const char* __lsan_default_suppressions(); // NOLINT: the sanitizer's name
extern "C" const char* __lsan_default_suppressions()  // NOLINT
{
  return "leak:Eigen::SparseMatrix\n";
}

namespace {

/// Allocations are counted while `counting` is set; number `failing` fails, and with `forGood` all later ones, too.
std::atomic<bool> counting{false}, forGood{false};
std::atomic<std::int64_t> allocations{0}, failing{-1};

bool mayAllocate()
{
  if (!counting)
    return true;
  const std::int64_t number = allocations++;
  return forGood ? number < failing : number != failing;
}

void* allocate(std::size_t bytes, std::size_t alignment) noexcept
{
  if (!mayAllocate())
    return nullptr;
  const std::size_t whole = (std::max<std::size_t>(bytes, 1) + alignment - 1) / alignment * alignment;
  return std::aligned_alloc(alignment, whole);
}

void* allocateOrThrow(std::size_t bytes, std::size_t alignment)
{
  if (void* memory = allocate(bytes, alignment))
    return memory;
  throw std::bad_alloc();
}

constexpr std::size_t natural = alignof(std::max_align_t);

} // namespace

// The operators for arrays call these.
void* operator new(std::size_t bytes)
{
  return allocateOrThrow(bytes, natural);
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept
{
  return allocate(bytes, natural);
}
void* operator new(std::size_t bytes, std::align_val_t a)
{
  return allocateOrThrow(bytes, std::size_t(a));
}
void operator delete(void* memory) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept
{
  std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept
{
  std::free(memory);
}

namespace {

/// About a hundred points, so that a run takes milliseconds.
Cloud::Ptr smallCloud()
{
  const auto cloud = conversion::make<pcl::PointNormal>(shapes::sample(shapes::sphere(1), 1.2, .35));
  cloud->header.frame_id = "a name that is too long for a string without memory of its own";
  return cloud;
}

pcl::mrf::Options smallOptions(int threads)
{
  pcl::mrf::Options options;
  options.threads = threads;
  options.remesher.rounds = 1;
  return options;
}

/// The class with that cloud as its input.
struct Small : Mrf {
  explicit Small(const pcl::mrf::Options& options = smallOptions(2))
  {
    setOptions(options);
    setInputCloud(smallCloud());
  }
};

/// Counts the allocations of a call, with those from `first` on failing.
template <typename Call>
std::int64_t countAllocations(std::int64_t first, bool allOfThem, const Call& call)
{
  allocations = 0;
  failing = first;
  forGood = allOfThem;
  counting = true;
  call();
  counting = false;
  return allocations;
}

/// Makes allocations of a run fail, one at a time: all of them, or as many as a test has time for.
void failAllocations(const pcl::mrf::Options& options, bool allOfThem)
{
  Small undisturbed(options);
  pcl::mrf::TriangleMesh expected;
  const std::int64_t total = countAllocations(-1, false, [&] { expected = run(undisturbed); });
  ASSERT_GT(total, 500);
  const char* every = std::getenv("MRF_EVERY_ALLOCATION");
  constexpr std::int64_t runs = 150;
  const std::int64_t step = every != nullptr ? 1 : total / runs + 1;
  std::int64_t failed = 0;
  for (std::int64_t n = 0; n < total; n += step) {
    SCOPED_TRACE(n);
    Small mrf(options);
    mrf.setKeepResult(true);
    Outputs<pcl::PointNormal> outputs;
    EXPECT_NO_THROW(countAllocations(n, allOfThem, [&] { mrf.reconstruct(outputs.mesh); }));
    counting = false;
    const Status status = mrf.getReport().status;
    if (status == Status::ok) { // some of the standard library's can be done without
      EXPECT_TRUE(sameBytes(conversion::plain(outputs.mesh), expected));
      continue;
    }
    ++failed;
    EXPECT_EQ(status, Status::resourceLimit) << mrf.getReport().message;
    EXPECT_NE(mrf.getReport().message.find("out of memory"), std::string::npos) << mrf.getReport().message;
    expectCleared(outputs.mesh);
    EXPECT_TRUE(mrf.getDistanceField().empty());
    if (failed == 1) {
      EXPECT_TRUE(sameBytes(run(mrf), expected)) << "the object works after its failure";
    }
    if (testing::Test::HasFailure())
      return;
  }
  EXPECT_GT(failed, runs / 4) << "the rest are buffers that sorting can do without";
}

} // namespace

class Memory : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Threads, Memory, testing::Values(1, 2));

TEST_P(Memory, OneAllocationThatFailsEndsTheRunInGoodOrder)
{
  failAllocations(smallOptions(GetParam()), false);
}

TEST_P(Memory, NoneIsNeededToEndTheRunInGoodOrder)
{
  failAllocations(smallOptions(GetParam()), true);
}

TEST(Memory, ThePapersSettingsEndInGoodOrderAsWell)
{
  pcl::mrf::Options options = pcl::mrf::paperPreset();
  options.search = pcl::mrf::SearchKind::bins; // FLANN allocates inside of a parallel loop, which nothing may leave
  options.threads = 2;
  options.solver.maxIterations = 20;
  // PCL's normals are estimated in a loop of OpenMP, which no exception can leave: there the process ends.
  options.normals.source = pcl::mrf::NormalSource::use;
  failAllocations(options, false);
}

TEST(Memory, TheOriginalExceptionLeavesOnRequest)
{
  Small mrf(smallOptions(1));
  mrf.setThrowing(true);
  Outputs<pcl::PointNormal> outputs;
  EXPECT_THROW(countAllocations(100, false, [&] { mrf.reconstruct(outputs.mesh); }), std::bad_alloc);
  counting = false;
  expectCleared(outputs.mesh);
  EXPECT_EQ(mrf.getReport().status, Status::resourceLimit);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) // they reserve terabytes of addresses
TEST(Memory, ThatIsFreeIsNotMoreThanTheProcessMayHave)
{
  const std::size_t before = pcl::mrf::availableMemory();
  EXPECT_GT(before, std::size_t{1} << 20);
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  rlimit unlimited{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &unlimited), 0);
  rlimit limited = unlimited;
  constexpr std::size_t room = std::size_t{32} << 20;
  limited.rlim_cur = pages * static_cast<std::size_t>(sysconf(_SC_PAGE_SIZE)) + room;
  ASSERT_EQ(setrlimit(RLIMIT_AS, &limited), 0);
  const std::size_t after = pcl::mrf::availableMemory();
  ASSERT_EQ(setrlimit(RLIMIT_AS, &unlimited), 0);
  EXPECT_LE(after, room);
}
#endif

TEST(Callbacks, WhatTheyThrowIsReportedOrLeavesOnRequest)
{
  Small mrf;
  const pcl::mrf::TriangleMesh expected = run(mrf);
  mrf.setProgressCallback([](const std::string& stage, double) -> bool {
    return stage != "polygonizer" ? true : throw std::length_error("the caller's own");
  });
  EXPECT_EQ(expectFailure(mrf, Status::callerError), "the progress callback failed: the caller's own");
  EXPECT_FALSE(mrf.getReport().levels.empty()) << "the report has what was done";
  EXPECT_GT(mrf.getReport().seconds, 0);
  EXPECT_GT(mrf.getReport().peakBytes, 0u);
  EXPECT_EQ(mrf.getReport().times.back().stage, "regularization");

  Outputs<pcl::PointNormal> outputs;
  mrf.setThrowing(true);
  EXPECT_THROW(mrf.reconstruct(outputs.mesh), std::length_error);
  expectCleared(outputs.mesh);
  mrf.setProgressCallback([](const std::string&, double) -> bool { throw 42; });
  EXPECT_THROW(mrf.reconstruct(outputs.points, outputs.polygons), int);
  EXPECT_TRUE(outputs.points.empty() && outputs.polygons.empty());

  mrf.setThrowing(false);
  EXPECT_EQ(expectFailure(mrf, Status::callerError), "the progress callback failed: an exception of an unknown type");
  mrf.setProgressCallback({});
  EXPECT_TRUE(sameBytes(run(mrf), expected));
}

TEST(Callbacks, EveryStageCanBeCancelled)
{
  Small mrf;
  mrf.setKeepResult(true);
  std::vector<std::string> stages;
  mrf.setProgressCallback([&](const std::string& stage, double) {
    if (std::find(stages.begin(), stages.end(), stage) == stages.end())
      stages.push_back(stage);
    return true;
  });
  const pcl::mrf::TriangleMesh expected = run(mrf);
  ASSERT_GE(stages.size(), 8u);
  for (const std::string& last : stages) {
    SCOPED_TRACE(last);
    int stops = 0;
    std::string called;
    mrf.setProgressCallback([&](const std::string& stage, double) {
      called = stage;
      return stage != last || ++stops == 0;
    });
    expectFailure(mrf, Status::cancelled, last);
    EXPECT_EQ(stops, 2) << "neither of the two runs calls it again after it asked to stop";
    EXPECT_EQ(called, last);
  }
  mrf.setProgressCallback({});
  EXPECT_TRUE(sameBytes(run(mrf), expected));
}

TEST(Searches, NonsenseIsRefused)
{
  using Indices = pcl::Indices;
  using Distances = std::vector<float>;
  const std::pair<const char*, ChangedSearch::Change> changes[] = {
      {"index -1", [](int found, Indices& indices, Distances&) { return indices[0] = -1, found; }},
      {"index 1000000", [](int found, Indices& indices, Distances&) { return indices[0] = 1000000, found; }},
      {"-1 neighbors", [](int, Indices&, Distances&) { return -1; }},
      {"neighbors", [](int found, Indices&, Distances&) { return found + 1; }},
      {"neighbors", [](int found, Indices&, Distances& distances) { return distances.clear(), found; }},
      {"distance of nan",
       [](int found, Indices&, Distances& distances) {
         return distances[0] = std::numeric_limits<float>::quiet_NaN(), found;
       }},
      {"distance of -1", [](int found, Indices&, Distances& distances) { return distances[0] = -1, found; }}};
  for (const auto& [words, change] : changes) {
    SCOPED_TRACE(words);
    Small mrf;
    mrf.setSearchMethod(std::make_shared<ChangedSearch>(change));
    expectFailure(mrf, Status::invalidInput, words);
  }
}

TEST(Searches, WhatTheyThrowIsReported)
{
  Small mrf;
  const auto search = std::make_shared<ChangedSearch>(
      [](int, pcl::Indices&, std::vector<float>&) -> int { throw std::runtime_error("no such tree"); });
  mrf.setSearchMethod(search);
  EXPECT_EQ(expectFailure(mrf, Status::callerError), "the object of setSearchMethod failed: no such tree");
  // Also inside of PCL's own parallel loop.
  mrf.setPreset(pcl::mrf::Preset::paper);
  std::atomic<bool> isNormals{false};
  mrf.setProgressCallback([&](const std::string& stage, double) { return isNormals = stage == "normals", true; });
  search->change = [&](int found, pcl::Indices&, std::vector<float>&) {
    return isNormals ? throw std::runtime_error("no more of it") : found;
  };
  EXPECT_EQ(expectFailure(mrf, Status::callerError), "the object of setSearchMethod failed: no more of it");
}

TEST(Callbacks, WhatAReaderOfAttributesThrowsIsReported)
{
  pcl::mrf::RawCloud cloud = clouds::raw(shapes::sample(shapes::sphere(1), 1.2, .35).positions);
  cloud.attributes = {false, true, [](std::size_t, float*) { throw std::runtime_error("no such point"); }};
  pcl::mrf::Execution execution(2);
  EXPECT_EQ(
      clouds::messageOf<pcl::mrf::CallerError>([&] { reconstruct(std::move(cloud), smallOptions(2), execution); }),
      "the reader of attributes failed: no such point");
}

TEST(Searches, MayAnswerOutOfOrder)
{
  Small mrf;
  const pcl::mrf::TriangleMesh expected = run(mrf);
  mrf.setSearchMethod(
      std::make_shared<ChangedSearch>([](int found, pcl::Indices& indices, std::vector<float>& distances) {
        std::reverse(indices.begin(), indices.end());
        std::reverse(distances.begin(), distances.end());
        return found;
      }));
  EXPECT_TRUE(sameBytes(run(mrf), expected));
}

TEST(Options, AReachBeyondAllVoxelsIsNoIndex)
{
  Small mrf;
  for (const float reach : {1e6f, 1e30f, std::numeric_limits<float>::max()}) {
    pcl::mrf::Options options = smallOptions(2);
    options.observation.kind = pcl::mrf::ObservationKind::plane;
    options.observation.maxDistance = reach;
    mrf.setOptions(options);
    EXPECT_FALSE(run(mrf).triangles.empty()) << reach;
  }
}

TEST(Sensors, ThatAreNowhere)
{
  Small mrf;
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    mrf.setSensorPosition({0, bad, 0});
    expectFailure(mrf, Status::invalidInput, "sensor 0");
  }
}

TEST(Scale, PowersOfTwoGiveTheSameBytesOrAClearError)
{
  const pcl::mrf::PointSet points =
      shapes::filter(shapes::sample(shapes::sphere(1), 1.2, .25), [](const auto& p) { return p.z() < .5f; });
  pcl::mrf::TriangleMesh expected;
  int same = 0;
  for (int exponent : {0, -149, -130, -100, -60, -40, -30, -22, -16, 16, 28, 32, 40, 63, 64, 100, 127}) {
    SCOPED_TRACE(exponent);
    const auto cloud = conversion::make<pcl::PointXYZ>(points);
    for (pcl::PointXYZ& point : *cloud)
      for (float& coordinate : point.data)
        coordinate = std::ldexp(coordinate, exponent);
    pcl::MRFReconstruction<pcl::PointXYZ> mrf;
    mrf.setOptions(smallOptions(2));
    mrf.setInputCloud(cloud);
    Outputs<pcl::PointXYZ> outputs;
    mrf.reconstruct(outputs.mesh);
    if (mrf.getReport().status != Status::ok) {
      EXPECT_EQ(mrf.getReport().status, Status::invalidInput);
      continue;
    }
    ++same;
    const pcl::mrf::TriangleMesh mesh = conversion::plain(outputs.mesh);
    if (exponent == 0)
      expected = mesh;
    ASSERT_EQ(mesh.triangles, expected.triangles);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
      ASSERT_EQ(mesh.vertices[v], expected.vertices[v] * std::ldexp(1.f, exponent));
  }
  EXPECT_GE(same, 5) << "from 2⁻²² to 2²⁸";
}

TEST(Output, KeepsItsFieldsAfterAFailure)
{
  On<pcl::PointXYZRGBNormal> mrf;
  pcl::PolygonMesh whole = outputOf(mrf), failed;
  mrf.setProgressCallback([](const std::string&, double) { return false; });
  mrf.reconstruct(failed);
  ASSERT_EQ(failed.cloud.fields.size(), whole.cloud.fields.size());
  for (std::size_t f = 0; f < whole.cloud.fields.size(); ++f)
    EXPECT_EQ(failed.cloud.fields[f].name, whole.cloud.fields[f].name);
  EXPECT_EQ(failed.cloud.point_step, whole.cloud.point_step);
  EXPECT_EQ(failed.cloud.width * failed.cloud.height, 0u);
  EXPECT_TRUE(failed.cloud.data.empty());
}

TEST(Warnings, AreLoggedOnce)
{
  // An open patch without a sensor: which side is the outside is a guess.
  On<pcl::PointXYZ> mrf(patch());
  pcl::PolygonMesh mesh;
  pcl::console::setVerbosityLevel(pcl::console::L_WARN);
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  mrf.reconstruct(mesh);
  const std::string logged = testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr();
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  ASSERT_EQ(mrf.getReport().status, Status::ok);
  ASSERT_FALSE(mrf.getReport().warnings.empty());
  for (const std::string& warning : mrf.getReport().warnings) {
    const std::size_t found = logged.find(warning);
    ASSERT_NE(found, std::string::npos) << logged;
    EXPECT_EQ(logged.find(warning, found + 1), std::string::npos) << "once";
  }
}

// SPDX-License-Identifier: BSD-3-Clause
// Clouds of every kind with valid options of every kind, each in a process of its own: whatever is asked, the answer is
// a valid mesh, or one clear error and no mesh, within limits of time and memory.
//   test_random_clouds [CASES [FIRST_SEED]]
// A case is named by its seed: CASES = 1 runs it alone.
#include "mesh/self_intersection.h"
#include "support/conversion.h"
#include "support/random_clouds.h"

#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>
#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/console/print.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

using pcl::mrf::Status;
using pcl::mrf::TriangleMesh;
using random_clouds::Cloud;

namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool isSanitized = true; // addresses are reserved by the terabyte
#else
constexpr bool isSanitized = false;
#endif
// A surface of below 100,000 points that takes a minute counts as hanging.
constexpr rlim_t secondsLimit = isSanitized ? 600 : 60;
constexpr rlim_t bytesLimit = rlim_t{2} << 30;

/// How a case ended, as the child says it in one line.
constexpr const char *meshPrefix = "mesh", *errorPrefix = "error";

float toFloat(double value)
{
  constexpr double largest = std::numeric_limits<float>::max();
  if (std::abs(value) > largest)
    return value < 0 ? -std::numeric_limits<float>::infinity() : std::numeric_limits<float>::infinity();
  return static_cast<float>(value);
}

Eigen::Vector3f toFloat(const Eigen::Vector3d& v)
{
  return {toFloat(v.x()), toFloat(v.y()), toFloat(v.z())};
}

template <typename PointT>
typename pcl::PointCloud<PointT>::Ptr makeCloud(const Cloud& cloud)
{
  typename pcl::PointCloud<PointT>::Ptr result(new pcl::PointCloud<PointT>);
  for (std::size_t n = 0; n < cloud.positions.size(); ++n) {
    PointT point;
    point.getVector3fMap() = toFloat(cloud.positions[n]);
    if constexpr (pcl::traits::has_normal<PointT>::value) {
      if (!cloud.normals.empty())
        point.getNormalVector3fMap() = toFloat(cloud.normals[n]);
      if (!cloud.confidences.empty())
        point.curvature = cloud.confidences[n];
    }
    if constexpr (pcl::traits::has_color<PointT>::value)
      point.r = static_cast<std::uint8_t>(n % 256);
    result->push_back(point);
  }
  return result;
}

/// What is wrong with a mesh; empty if nothing is.
std::string faultOf(const TriangleMesh& mesh)
{
  std::ostringstream text;
  if (mesh.triangles.empty())
    return "no triangles";
  for (const auto& triangle : mesh.triangles)
    for (const auto vertex : triangle)
      if (vertex < 0 || static_cast<std::size_t>(vertex) >= mesh.vertices.size())
        return "an index out of range";
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!mesh.vertices[v].allFinite())
      return "a vertex that is not finite";
    if (!(std::abs(mesh.normals.at(v).norm() - 1) < 1e-3f)) // they are normalized in single precision
      text << "a normal of length " << mesh.normals[v].norm() << "; ";
    if (!(mesh.confidences.at(v) >= 0 && mesh.confidences[v] <= 1))
      text << "a confidence of " << mesh.confidences[v] << "; ";
    if (!text.str().empty())
      return text.str();
  }
  const pcl::mrf::MeshStatistics statistics = pcl::mrf::measure(mesh);
  if (!statistics.manifold())
    text << statistics.nonManifoldEdges << " edges and " << statistics.nonManifoldVertices
         << " vertices that are not manifold; ";
  if (statistics.unusedVertices > 0)
    text << statistics.unusedVertices << " vertices without a triangle; ";
  return text.str();
}

/// What is wrong with how a run failed; empty if nothing is.
std::string faultOf(const pcl::mrf::Report& report, const pcl::PolygonMesh& mesh)
{
  const bool isExpected = report.status == Status::invalidInput || report.status == Status::invalidOption ||
                          report.status == Status::resourceLimit || report.status == Status::solverFailure;
  if (!isExpected)
    return std::string("it ended with ") + toString(report.status) + ": " + report.message;
  if (!mesh.polygons.empty() || !mesh.cloud.data.empty())
    return "a mesh in spite of an error";
  if (report.message.size() < 20 || report.message.find('\n') != std::string::npos)
    return "a message that is not one clear line: '" + report.message + "'";
  if (report.message.find("nan") != std::string::npos)
    return "a message about nothing: '" + report.message + "'";
  return {};
}

/// Runs a cloud as a user does. \return the line that the child writes
template <typename PointT>
std::string runAs(const Cloud& cloud, pcl::mrf::Options options, bool again)
{
  pcl::MRFReconstruction<PointT> mrf;
  mrf.setOptions(options);
  mrf.setInputCloud(makeCloud<PointT>(cloud));
  mrf.setSensorPositions(cloud.sensors, cloud.views);
  pcl::PolygonMesh output;
  mrf.reconstruct(output);
  const pcl::mrf::Report report = mrf.getReport();
  const std::string fault = report.status == Status::ok ? faultOf(conversion::plain(output)) : faultOf(report, output);
  if (!fault.empty())
    return fault;
  const TriangleMesh mesh = conversion::plain(output);
  if (again) {
    options.threads = options.threads == 1 ? 3 : 1;
    mrf.setOptions(options);
    pcl::PolygonMesh other;
    mrf.reconstruct(other);
    // What is free differs from run to run, and messages about it say how much.
    const bool isSameEnd = mrf.getReport().status == report.status &&
                           (report.status == Status::resourceLimit || mrf.getReport().message == report.message);
    if (!isSameEnd || !conversion::sameBytes(conversion::plain(other), mesh))
      return "another result with another number of threads: " + mrf.getReport().message;
  }
  if (report.status != Status::ok)
    return std::string(errorPrefix) + " " + toString(report.status) + ": " + report.message;
  std::ostringstream text;
  text << meshPrefix << ' ' << mesh.triangles.size() << " triangles, " << selfIntersectingTriangles(mesh).size()
       << " intersect";
  return text.str();
}

/// A case, drawn by its seed.
struct Case {
  std::uint64_t seed;
  Cloud cloud;
  pcl::mrf::Options options;
  std::string description;
  bool again; ///< also with another number of threads

  explicit Case(std::uint64_t number) : seed(number)
  {
    random_clouds::Random random(seed * 7919 + 15);
    const auto& kinds = random_clouds::kinds();
    cloud = drawCloud(kinds[seed % kinds.size()], random);
    std::ostringstream text;
    text << "seed " << seed << ", " << cloud.kind << ", " << cloud.positions.size() << " points"
         << (cloud.normals.empty() ? "" : ", normals") << (cloud.hasColors ? ", colors" : "");
    if (!cloud.sensors.empty())
      text << ", " << cloud.sensors.size() << " sensors" << (cloud.views.empty() ? "" : " and views");
    text << (cloud.confidences.empty() ? "" : ", confidences") << ", options:";
    description = text.str();
    options = drawOptions(cloud, random, description);
    if (!cloud.confidences.empty())
      options.confidenceField = "curvature";
    again = random.oneIn(5);
    // Without normals the type may still have room for them, and they are zero.
    hasRoomForNormals_ = !cloud.normals.empty() || !cloud.confidences.empty() || random.oneIn(3);
    const bool needsNormals = options.normals.source == pcl::mrf::NormalSource::use ||
                              options.normals.source == pcl::mrf::NormalSource::reference;
    hasRoomForNormals_ = hasRoomForNormals_ || needsNormals;
  }

  std::string run() const
  {
    if (cloud.hasColors && hasRoomForNormals_)
      return runAs<pcl::PointXYZRGBNormal>(cloud, options, again);
    if (cloud.hasColors)
      return runAs<pcl::PointXYZRGB>(cloud, options, again);
    if (hasRoomForNormals_)
      return runAs<pcl::PointNormal>(cloud, options, again);
    return runAs<pcl::PointXYZ>(cloud, options, again);
  }

private:
  bool hasRoomForNormals_;
};

struct Outcome {
  std::string line; ///< the child's; empty if it did not write one
  int status = 0;   ///< of waitpid
};

void setLimits()
{
  // The first limit of processor time sends a signal, the second one kills.
  const rlimit time{secondsLimit, secondsLimit + 5}, memory{bytesLimit, bytesLimit}, core{0, 0};
  setrlimit(RLIMIT_CPU, &time);
  setrlimit(RLIMIT_CORE, &core);
  if (!isSanitized)
    setrlimit(RLIMIT_AS, &memory);
  alarm(20 * secondsLimit); // for what waits without working, on a busy machine
}

Outcome runInChild(std::uint64_t seed)
{
  int ends[2];
  if (pipe(ends) != 0) {
    std::perror("pipe");
    std::exit(2);
  }
  std::fflush(stdout);
  const pid_t child = fork();
  if (child < 0) {
    std::perror("fork");
    std::exit(2);
  }
  if (child == 0) {
    setLimits();
    const std::string line = Case(seed).run();
    const bool isWritten = write(ends[1], line.data(), line.size()) == static_cast<ssize_t>(line.size());
    std::exit(isWritten ? 0 : 2); // not _exit, so that the sanitizer looks for leaks
  }
  close(ends[1]);
  Outcome outcome;
  char buffer[4096];
  for (ssize_t count = 0; (count = read(ends[0], buffer, sizeof(buffer))) > 0;)
    outcome.line.append(buffer, static_cast<std::size_t>(count));
  close(ends[0]);
  waitpid(child, &outcome.status, 0);
  return outcome;
}

/// \return why the case failed; empty if it did not
std::string failureOf(const Outcome& outcome)
{
  if (WIFSIGNALED(outcome.status)) {
    const int number = WTERMSIG(outcome.status);
    const bool isTime = number == SIGXCPU || number == SIGALRM || number == SIGKILL;
    return std::string("ended by signal ") + strsignal(number) + (isTime ? ", the limit of time" : "");
  }
  if (!WIFEXITED(outcome.status) || WEXITSTATUS(outcome.status) != 0)
    return "ended with status " + std::to_string(WEXITSTATUS(outcome.status));
  const auto startsWith = [&](const char* prefix) { return outcome.line.rfind(prefix, 0) == 0; };
  return startsWith(meshPrefix) || startsWith(errorPrefix) ? "" : outcome.line;
}

} // namespace

int main(int argc, char** argv)
{
  const std::uint64_t cases = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : isSanitized ? 20 : 200;
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 0;
  if (argc > 3 || cases == 0) {
    std::fprintf(stderr, "usage: test_random_clouds [CASES [FIRST_SEED]]\n");
    return 2;
  }
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS); // errors are expected
  std::uint64_t failures = 0, meshes = 0;
  for (std::uint64_t seed = first; seed < first + cases; ++seed) {
    const Outcome outcome = runInChild(seed);
    const std::string failure = failureOf(outcome);
    meshes += outcome.line.rfind(meshPrefix, 0) == 0;
    failures += !failure.empty();
    if (!failure.empty() || cases == 1)
      std::printf("%s\n  %s\n", Case(seed).description.c_str(), (failure.empty() ? outcome.line : failure).c_str());
  }
  std::printf("%llu cases: %llu meshes, %llu clear errors, %llu failures\n", static_cast<unsigned long long>(cases),
              static_cast<unsigned long long>(meshes), static_cast<unsigned long long>(cases - meshes - failures),
              static_cast<unsigned long long>(failures));
  return failures == 0 ? 0 : 1;
}

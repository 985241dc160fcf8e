// SPDX-License-Identifier: BSD-3-Clause
/// The whole method on plain arrays, without PCL's point types, with progress, Ctrl-C to cancel, and the field.
///
///     example_plain_arrays points.xyz mesh.obj       (a line: x y z)

#include <pcl/surface/mrf/reconstruction.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

namespace {

volatile std::sig_atomic_t interrupted = 0;

/// Called often, on the thread that runs the method. \return false to cancel
bool showProgress(const std::string& stage, double fraction)
{
  std::fprintf(stderr, "\r%-20s %3.0f %%", stage.c_str(), 100 * fraction);
  return interrupted == 0;
}

std::vector<Eigen::Vector3f> readPoints(const char* path)
{
  std::ifstream file(path);
  std::vector<Eigen::Vector3f> positions;
  for (Eigen::Vector3f p; file >> p.x() >> p.y() >> p.z();)
    positions.push_back(p);
  return positions;
}

bool writeObj(const char* path, const pcl::mrf::TriangleMesh& mesh, const Eigen::Vector3d& offset)
{
  std::ofstream file(path);
  file.precision(9);
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    file << "v " << (vertex.cast<double>() + offset).transpose() << '\n';
  for (const pcl::mrf::Triangle& t : mesh.triangles)
    file << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  return static_cast<bool>(file.flush());
}

/// The mean distance between the used points and the zero level of the field; it is not zero because of the smoothing.
double meanDistance(const pcl::mrf::Reconstruction& result)
{
  double sum = 0;
  for (const Eigen::Vector3f& position : result.points.positions) {
    Eigen::Vector3f gradient;
    const float distance = result.field.sampleDistance(position, gradient);
    sum += static_cast<double>(std::abs(distance) / gradient.norm());
  }
  return sum / static_cast<double>(result.points.size());
}

} // namespace

int main(int argc, char** argv)
{
  if (argc != 3) {
    std::cerr << "usage: " << argv[0] << " points.xyz mesh.obj\n";
    return 2;
  }
  std::signal(SIGINT, [](int) { interrupted = 1; });
  try {
    pcl::mrf::Execution execution(0, showProgress); // all threads; the result does not depend on their number
    pcl::mrf::RawCloud cloud;                       // also takes normals, confidences and sensors
    cloud.positions = readPoints(argv[1]);
    const pcl::mrf::Options options; // the defaults; pcl::mrf::presetOptions(pcl::mrf::Preset::paper): the paper's
    const pcl::mrf::Reconstruction result = pcl::mrf::reconstruct(std::move(cloud), options, execution);
    std::cerr << '\n';
    std::cout << result.report.mesh.triangles << " triangles, " << result.report.mesh.components
              << " component(s), points are " << meanDistance(result) << " from the surface in the mean\n";
    return writeObj(argv[2], result.mesh, result.points.offset) ? 0 : 1;
  } catch (const pcl::mrf::Cancelled&) {
    std::cerr << "\nleft\n";
    return 130;
  } catch (const pcl::mrf::Error& error) {
    std::cerr << '\n' << pcl::mrf::toString(error.status()) << ": " << error.message() << '\n';
    return 1;
  }
}

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The stages one by one on plain arrays, without PCL's point types; with progress, and Ctrl-C to leave.
///
///     example_stages points.xyz mesh.obj       (a line: x y z)
///
/// What pcl::mrf::reconstruct does beyond this: it chooses smoothing and voxel size by points left out, grows the
/// volume beside openings, and solves parts that are far apart on their own.

#include <pcl/surface/mrf/multiscale.h>
#include <pcl/surface/mrf/polygonizer.h>
#include <pcl/surface/mrf/reconstruction.h>
#include <pcl/surface/mrf/remesher.h>
#include <pcl/surface/mrf/trimming.h>
#include <pcl/surface/mrf/vertex_fields.h>

#include <csignal>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

namespace {

volatile std::sig_atomic_t interrupted = 0;

/// Called from this thread, several times a second. \return false to cancel
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

/// \throw pcl::mrf::Error
pcl::mrf::TriangleMesh reconstruct(const std::vector<Eigen::Vector3f>& positions, pcl::mrf::Execution& execution,
                                   Eigen::Vector3d& offset)
{
  namespace mrf = pcl::mrf;
  const mrf::Options options = mrf::defaultPreset();
  mrf::Report report;

  // Points without normals, confidences and sensors, recentered; then outliers, normals and their sides (Sec. 3.1).
  mrf::RawCloud cloud;
  cloud.positions = positions;
  mrf::PointSet gathered = mrf::gather(std::move(cloud), options, report.points, execution);
  const auto search = mrf::makePointBins();
  const mrf::OrientedPoints points = mrf::preprocess(std::move(gathered), options, *search, report, execution);
  offset = points.offset;
  const float spacing = report.density.spacing;
  const mrf::BoundingBox box = mrf::boundingBox(points.positions);

  // The signed distance, coarse to fine (Sec. 3.2 to 3.4). Its zero level is the surface (Sec. 3.5).
  execution.beginStage("regularization");
  const mrf::DistanceField field = mrf::regularize(points, *search, spacing, box, options.observation, options.prior,
                                                   options.solver, options.multiscale, execution)
                                       .field;
  execution.beginStage("polygonizer");
  mrf::TriangleMesh mesh = mrf::polygonize(field, options.polygonizer, execution);

  // What no point supports goes, but for holes; the rest gets triangles of one size.
  execution.beginStage("trimming");
  const float reach = mrf::resolvedMaxDistance(options.observation, spacing, 2 * spacing);
  const mrf::Support support(points, *search, reach, spacing);
  mrf::setConfidences(mesh, support, options.observation.confidenceShape, execution);
  mesh = mrf::trim(std::move(mesh), points, *search, box.diagonal(), options.trimming, execution).mesh;
  execution.beginStage("remesher");
  mesh = mrf::remesh(mesh, field, options.remesher, execution).mesh;
  mrf::setNormals(mesh, field, execution);
  return mesh;
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
    pcl::mrf::Execution execution(0, showProgress); // all threads; the result does not depend on how many
    Eigen::Vector3d offset;
    const pcl::mrf::TriangleMesh mesh = reconstruct(readPoints(argv[1]), execution, offset);
    const pcl::mrf::MeshStatistics statistics = pcl::mrf::measure(mesh);
    std::cerr << '\n';
    std::cout << statistics.triangles << " triangles, " << statistics.components << " component(s)\n";
    return writeObj(argv[2], mesh, offset) ? 0 : 1;
  } catch (const pcl::mrf::Cancelled&) {
    std::cerr << "\nleft\n";
    return 130;
  } catch (const pcl::mrf::Error& error) {
    std::cerr << '\n' << pcl::mrf::toString(error.status()) << ": " << error.message() << '\n';
    return 1;
  }
}

// SPDX-License-Identifier: BSD-3-Clause
// Reconstructs a sphere as a user of the installed library would. Argument: the solver.
#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/point_types.h>

#include <cmath>
#include <cstdio>
#include <string>

namespace {

pcl::PointCloud<pcl::PointNormal>::Ptr sphere(int count)
{
  pcl::PointCloud<pcl::PointNormal>::Ptr cloud(new pcl::PointCloud<pcl::PointNormal>);
  const double goldenAngle = M_PI * (3 - std::sqrt(5.));
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.) / count, r = std::sqrt(1 - z * z), angle = goldenAngle * i;
    pcl::PointNormal point;
    point.x = point.normal_x = static_cast<float>(r * std::cos(angle));
    point.y = point.normal_y = static_cast<float>(r * std::sin(angle));
    point.z = point.normal_z = static_cast<float>(z);
    cloud->push_back(point);
  }
  return cloud;
}

} // namespace

int main(int argc, char** argv)
{
  const std::string solver = argc > 1 ? argv[1] : "multigrid";

  pcl::MRFReconstruction<pcl::PointNormal> mrf;
  mrf.setInputCloud(sphere(1000));
  if (solver == "cholesky") {
    mrf.setSolver(pcl::mrf::SolverMethod::cholesky);
    mrf.setPrior(pcl::mrf::Prior::membrane);
  }
  pcl::PolygonMesh mesh;
  mrf.reconstruct(mesh);
  const pcl::mrf::Report& report = mrf.getReport();
  std::printf("%s: %s, %zu of %lld triangles, Euler characteristic %lld, volume %.3f\n", solver.c_str(),
              report.message.c_str(), mesh.polygons.size(), static_cast<long long>(report.mesh.triangles),
              static_cast<long long>(report.mesh.eulerCharacteristic), report.mesh.volume);

  // A sphere from 1000 points, l̄ = 0.11, h = 0.22: five per cent of volume are a quarter of h²·curvature² and generous.
  const bool isSphere = report.status == pcl::mrf::Status::ok && report.mesh.closed() &&
                        report.mesh.eulerCharacteristic == 2 &&
                        mesh.polygons.size() == static_cast<std::size_t>(report.mesh.triangles) &&
                        std::abs(report.mesh.volume - 4 * M_PI / 3) < .05 * 4 * M_PI / 3;
  return isSphere ? 0 : 1;
}

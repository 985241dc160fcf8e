// SPDX-License-Identifier: BSD-3-Clause
// From a file of points to a mesh in a file: files_to_mesh scan.pcd mesh.ply
#include <pcl/console/print.h>
#include <pcl/conversions.h>
#include <pcl/io/auto_io.h>
#include <pcl/point_types.h>
#include <pcl/surface/mrf_reconstruction.h>

#include <iostream>

int main(int argc, char** argv)
{
  if (argc != 3) {
    std::cerr << "usage: " << argv[0] << " scan.pcd|ply|obj mesh.ply\n";
    return 2;
  }
  pcl::PCLPointCloud2 file;
  if (pcl::io::load(argv[1], file) < 0)
    return 1;
  const pcl::PointCloud<pcl::PointNormal>::Ptr cloud(new pcl::PointCloud<pcl::PointNormal>);
  pcl::console::setVerbosityLevel(pcl::console::L_ERROR); // nothing of fields that the file lacks, such as curvature
  pcl::fromPCLPointCloud2(file, *cloud);
  pcl::console::setVerbosityLevel(pcl::console::L_INFO);

  pcl::MRFReconstruction<pcl::PointNormal> mrf; // without normals in the file they are estimated, and a warning says so
  mrf.setInputCloud(cloud);
  pcl::PolygonMesh mesh;
  mrf.reconstruct(mesh); // logs errors and warnings, and keeps them in the report

  const pcl::mrf::Report& report = mrf.getReport();
  if (report.status != pcl::mrf::Status::ok)
    return 1; // the mesh is empty, report.message says why
  std::cout << report.points.used << " of " << report.points.input << " points, " << report.mesh.triangles
            << " triangles, " << report.seconds << " s\n";
  return pcl::mrf::savePLY(argv[2], mesh) < 0 ? 1 : 0; // PCL's own writer leaves the field `confidence` out
}

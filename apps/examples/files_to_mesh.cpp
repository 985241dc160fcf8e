// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief From a file of points to a mesh in a file, with everything that may go wrong told.
///
///     example_files_to_mesh scan.pcd mesh.ply

#include <pcl/surface/mrf/mesh_files.h>
#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/common/io.h>
#include <pcl/conversions.h>
#include <pcl/io/auto_io.h>
#include <pcl/point_types.h>

#include <cstdio>

namespace {

/// Normals are used if the points have them, else they are estimated and oriented.
template <typename PointT>
bool reconstruct(const pcl::PCLPointCloud2& file, pcl::PolygonMesh& mesh)
{
  typename pcl::PointCloud<PointT>::Ptr cloud(new pcl::PointCloud<PointT>);
  pcl::fromPCLPointCloud2(file, *cloud);

  pcl::MRFReconstruction<PointT> mrf;
  mrf.setInputCloud(cloud);
  mrf.reconstruct(mesh); // warnings and errors are logged on stderr, and kept in the report

  const pcl::mrf::Report& report = mrf.getReport();
  if (report.status != pcl::mrf::Status::ok)
    return false; // the mesh is empty
  std::printf("%lld of %lld points used, voxels of %g, %lld triangles, %s, %.1f s\n",
              static_cast<long long>(report.points.used), static_cast<long long>(report.points.input),
              static_cast<double>(report.options.multiscale.voxelSize), static_cast<long long>(report.mesh.triangles),
              report.mesh.closed() ? "closed" : "open", report.seconds);
  return true;
}

} // namespace

int main(int argc, char** argv)
{
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s scan.pcd|ply mesh.ply\n", argv[0]);
    return 2;
  }
  pcl::PCLPointCloud2 file;
  if (pcl::io::load(argv[1], file) < 0)
    return 1;
  const bool hasNormals = pcl::getFieldIndex(file, "normal_x") >= 0;
  pcl::PolygonMesh mesh;
  if (hasNormals ? !reconstruct<pcl::PointNormal>(file, mesh) : !reconstruct<pcl::PointXYZ>(file, mesh))
    return 1;
  return pcl::mrf::savePLY(argv[2], mesh) < 0 ? 1 : 0; // with `confidence`, which PCL's own writer leaves out
}

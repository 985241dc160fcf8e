// SPDX-License-Identifier: BSD-3-Clause
/// A program written for pcl::Poisson, with the method replaced behind the base class: the same calls, also for a
/// subset of the points and a search object.
///
///     example_poisson_replaced poisson|mrf scan.pcd mesh.ply      (a scan with normals)

#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/console/print.h>
#include <pcl/conversions.h>
#include <pcl/io/auto_io.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/surface/poisson.h>

#include <cstdio>
#include <string>

using Point = pcl::PointNormal;
using Method = pcl::SurfaceReconstruction<Point>;

namespace {

Method::Ptr makeMethod(const std::string& name)
{
  if (name == "poisson") {
    pcl::Poisson<Point>::Ptr poisson(new pcl::Poisson<Point>);
    poisson->setDepth(8);
    return poisson;
  }
  return Method::Ptr(new pcl::MRFReconstruction<Point>); // nothing to set: lengths follow from the points
}

/// The points that have a normal.
pcl::IndicesPtr withNormals(const pcl::PointCloud<Point>& cloud)
{
  pcl::IndicesPtr indices(new pcl::Indices);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (cloud[i].getNormalVector3fMap().norm() > .5f)
      indices->push_back(static_cast<pcl::index_t>(i));
  return indices;
}

} // namespace

int main(int argc, char** argv)
{
  if (argc != 4) {
    std::fprintf(stderr, "usage: %s poisson|mrf scan.pcd|ply mesh.ply\n", argv[0]);
    return 2;
  }
  pcl::PCLPointCloud2 file;
  if (pcl::io::load(argv[2], file) < 0)
    return 1;
  pcl::PointCloud<Point>::Ptr cloud(new pcl::PointCloud<Point>);
  pcl::console::setVerbosityLevel(pcl::console::L_ERROR); // nothing of fields that the file lacks, such as curvature
  pcl::fromPCLPointCloud2(file, *cloud);
  pcl::console::setVerbosityLevel(pcl::console::L_INFO);

  const Method::Ptr method = makeMethod(argv[1]);
  method->setInputCloud(cloud);
  method->setIndices(withNormals(*cloud)); // pcl::Poisson ignores them and takes all points
  method->setSearchMethod(pcl::search::KdTree<Point>::Ptr(new pcl::search::KdTree<Point>));
  pcl::PolygonMesh mesh;
  method->reconstruct(mesh);

  // The report, which pcl::Poisson does not have.
  if (const auto* mrf = dynamic_cast<const pcl::MRFReconstruction<Point>*>(method.get()))
    std::printf("%s: %lld points, volume %.4g\n", mrf->getReport().message.c_str(),
                static_cast<long long>(mrf->getReport().points.input), mrf->getReport().mesh.volume);
  if (mesh.polygons.empty())
    return 1;
  std::printf("%s: %zu triangles\n", argv[1], mesh.polygons.size());
  return pcl::mrf::savePLY(argv[3], mesh) < 0 ? 1 : 0; // PCL's own writer warns of fields that it does not know
}

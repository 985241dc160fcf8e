// SPDX-License-Identifier: BSD-3-Clause
/// Colors the mesh as the scan, or by confidence.
///
///     example_colors scan.pcd mesh.ply [confidence]

#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/common/io.h>
#include <pcl/conversions.h>
#include <pcl/io/auto_io.h>
#include <pcl/point_types.h>

#include <cstdio>
#include <string>
#include <vector>

using Point = pcl::PointXYZRGB;

int main(int argc, char** argv)
{
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s scan.pcd|ply mesh.ply [confidence]\n", argv[0]);
    return 2;
  }
  const bool byConfidence = argc > 3 && std::string(argv[3]) == "confidence";
  pcl::PCLPointCloud2 file;
  if (pcl::io::load(argv[1], file) < 0)
    return 1;
  pcl::PointCloud<Point>::Ptr cloud(new pcl::PointCloud<Point>);
  pcl::fromPCLPointCloud2(file, *cloud);
  const bool hasColors = pcl::getFieldIndex(file, "rgb") >= 0 || pcl::getFieldIndex(file, "rgba") >= 0;
  if (!byConfidence && !hasColors)
    std::printf("the scan has no colors: the mesh is black; color it by its confidence\n");

  pcl::MRFReconstruction<Point> mrf;
  mrf.setInputCloud(cloud);
  mrf.setColorMode(byConfidence ? pcl::mrf::ColorMode::confidence : pcl::mrf::ColorMode::input);
  // This overload of PCL's classes gives vertices of the input's type.
  pcl::PointCloud<Point> vertices;
  std::vector<pcl::Vertices> triangles;
  mrf.reconstruct(vertices, triangles);
  if (mrf.getReport().status != pcl::mrf::Status::ok)
    return 1;

  std::vector<double> sum(3, 0);
  for (const Point& vertex : vertices) {
    sum[0] += vertex.r;
    sum[1] += vertex.g;
    sum[2] += vertex.b;
  }
  const double count = static_cast<double>(vertices.size());
  std::printf("%zu vertices, mean color %.0f %.0f %.0f\n", vertices.size(), sum[0] / count, sum[1] / count,
              sum[2] / count);

  pcl::PolygonMesh mesh;
  pcl::toPCLPointCloud2(vertices, mesh.cloud);
  mesh.polygons = triangles;
  return pcl::mrf::savePLY(argv[2], mesh) < 0 ? 1 : 0;
}

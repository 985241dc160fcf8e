// SPDX-License-Identifier: BSD-3-Clause
/// A point type of your own, such as that of a scanner's driver, as input and for the vertices.
///
///     example_own_points points.xyz mesh.ply       (a line: x y z)

#include <pcl/surface/impl/mrf_reconstruction.hpp> // instead of mrf_reconstruction.h, to compile it for this type
#include <pcl/surface/mrf/triangle_mesh.h>

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <vector>

/// The class uses the fields with these names; all other members stay 0 at the vertices.
struct Echo {
  float x, y, z;
  std::uint32_t rgb;
  float intensity;
  std::uint32_t line; ///< line of the scanner, which the class does not know
};
POINT_CLOUD_REGISTER_POINT_STRUCT(Echo, (float, x, x)(float, y, y)(float, z, z)(std::uint32_t, rgb,
                                                                                rgb)(float, intensity, intensity))

int main(int argc, char** argv)
{
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s points.xyz mesh.ply\n", argv[0]);
    return 2;
  }
  pcl::PointCloud<Echo>::Ptr cloud(new pcl::PointCloud<Echo>);
  std::ifstream file(argv[1]);
  for (Echo echo{}; file >> echo.x >> echo.y >> echo.z;) {
    echo.rgb = 0x804020;
    echo.intensity = .5f;
    echo.line = static_cast<std::uint32_t>(cloud->size() / 1024);
    cloud->push_back(echo);
  }

  pcl::MRFReconstruction<Echo> mrf;
  mrf.setInputCloud(cloud);
  mrf.setSearchMethod(pcl::search::KdTree<Echo>::Ptr(new pcl::search::KdTree<Echo>)); // optional
  pcl::PolygonMesh mesh; // its cloud has fields rgb and intensity
  mrf.reconstruct(mesh);
  if (mrf.getReport().status != pcl::mrf::Status::ok)
    return 1;

  pcl::PointCloud<Echo> vertices;
  std::vector<pcl::Vertices> triangles;
  mrf.reconstruct(vertices, triangles);
  double sum = 0;
  for (const Echo& vertex : vertices)
    sum += vertex.intensity;
  std::printf("%zu vertices, mean intensity %.2f\n", vertices.size(), sum / static_cast<double>(vertices.size()));
  return pcl::mrf::savePLY(argv[2], mesh) < 0 ? 1 : 0;
}

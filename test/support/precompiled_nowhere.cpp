// SPDX-License-Identifier: BSD-3-Clause
// Before the first header of PCL's: from here on no template is expected to be compiled elsewhere.
#define PCL_NO_PRECOMPILE

#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/point_types.h>

#include <cmath>
#include <cstdint>

namespace precompiled_nowhere {

struct Position {
  float x, y, z;
};

} // namespace precompiled_nowhere

POINT_CLOUD_REGISTER_POINT_STRUCT(precompiled_nowhere::Position, (float, x, x)(float, y, y)(float, z, z))

namespace precompiled_nowhere {

std::int64_t componentsOfASphere(); // test_custom_points calls it
std::int64_t componentsOfASphere()
{
  constexpr int count = 800;
  pcl::PointCloud<Position>::Ptr cloud(new pcl::PointCloud<Position>);
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.) / count, r = std::sqrt(1 - z * z), angle = 2.399963 * i;
    cloud->push_back(
        {static_cast<float>(r * std::cos(angle)), static_cast<float>(r * std::sin(angle)), static_cast<float>(z)});
  }
  pcl::MRFReconstruction<Position> mrf;
  mrf.setInputCloud(cloud);
  pcl::PolygonMesh mesh;
  mrf.reconstruct(mesh);
  return mrf.getReport().mesh.components;
}

} // namespace precompiled_nowhere

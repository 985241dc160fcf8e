// SPDX-License-Identifier: BSD-3-Clause
/// The real scans beside the project, if they are there, and simulated ones.
#pragma once

#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace scans {

/// One case of ../shared/data, seen from the source directory.
struct Scan {
  pcl::mrf::PointSet points; ///< not recentered: offset 0; with normals, and sensors and views if they are known
  std::vector<Eigen::Vector3d> heldOut; ///< noise-free points that the holes removed
  std::vector<Eigen::Vector3d> clean;   ///< the inliers before noise; the input itself if it has no noise
  double diagonal = 0;                  ///< of the bounding box, the unit of relative distances
};

/// True if the folder of scans exists; for the name of a simulated scan, if its model does.
bool available(const std::string& name = {});

/// The names that are available.
std::vector<std::string> available(std::vector<std::string> names);

/// Reads igea_clean, igea_noise, nefertiti, bunny or bunny_raw, or an open cloud: real/kinect_table,
/// real/kinect_office, real/samp11 or real/dragon_one.
///
/// Or simulates one: "model", 30,000 points of the bunny among the models of glmark2 (Debian's glmark2-data) with three
/// holes of 3.5 % of the diagonal; "model_noise", the same with noise of .25 %; "model_front", seen by one sensor;
/// "table", seen by a scanner in front of it; "street", seen by a lidar of 32 beams 1.8 above the ground, one ray every
/// .2 degrees around, ranges with noise of .01: rings lie up to 50 times as far apart as their points.
Scan load(const std::string& name);

} // namespace scans

/// Exact distance, by CGAL, from each point to the closest point of the mesh, in the order of the points.
std::vector<double> distancesToMesh(const std::vector<Eigen::Vector3d>& points, const pcl::mrf::TriangleMesh& mesh);

/// Skips a test if the real scans are missing: users have the sources without them.
#define SKIP_WITHOUT_SCANS()                                                                                           \
  if (!scans::available())                                                                                             \
  GTEST_SKIP() << "no ../shared/data beside the source directory"

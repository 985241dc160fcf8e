// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The real scans that lie beside the project, where they do.
#pragma once

#include <pcl/surface/mrf/point_set.h>

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace scans {

/// One case of ../shared/data, seen from the source directory.
struct Scan {
  pcl::mrf::PointSet points;            ///< not recentered: offset 0; with normals, sensors and views
  std::vector<Eigen::Vector3d> heldOut; ///< noise-free points that the holes removed
  std::vector<Eigen::Vector3d> clean;   ///< the inliers before noise; the input itself where there is no noise
  double diagonal = 0;                  ///< of the bounding box that distances are quoted relative to
};

/// True if the folder of scans is there.
bool available();

/// Reads igea_clean, igea_noise, nefertiti, bunny or bunny_raw, or a cloud of loadReal after "real/".
Scan load(const std::string& name);

/// Reads kinect_table, kinect_office, samp11 or dragon_one: open clouds, with normals, and the sensor where it is
/// known.
pcl::mrf::PointSet loadReal(const std::string& name);

/// The vertices of a mesh of the folder reference, without normals.
pcl::mrf::PointSet loadReference(const std::string& name);

} // namespace scans

/// Skips a test that needs the scans where they are not: users have the sources without them.
#define SKIP_WITHOUT_SCANS()                                                                                           \
  if (!scans::available())                                                                                             \
  GTEST_SKIP() << "no ../shared/data beside the source directory"

// SPDX-License-Identifier: BSD-3-Clause
#include "support/scans.h"

#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <fstream>
#include <map>
#include <stdexcept>

namespace scans {
namespace {

const std::string folder = std::string(MRF_SOURCE_DIR) + "/../shared/data/";

pcl::PointCloud<pcl::PointNormal> readCloud(const std::string& path)
{
  pcl::PointCloud<pcl::PointNormal> cloud;
  if (pcl::io::loadPLYFile(path, cloud) < 0)
    throw std::runtime_error("cannot read " + path);
  return cloud;
}

std::vector<Eigen::Vector3d> positionsOf(const pcl::PointCloud<pcl::PointNormal>& cloud)
{
  std::vector<Eigen::Vector3d> positions;
  for (const pcl::PointNormal& point : cloud)
    positions.push_back(point.getVector3fMap().cast<double>());
  return positions;
}

/// Positions and normals, not recentered.
pcl::mrf::PointSet pointsOf(const pcl::PointCloud<pcl::PointNormal>& cloud)
{
  pcl::mrf::PointSet points;
  for (const pcl::PointNormal& point : cloud) {
    points.origins.push_back(static_cast<std::uint32_t>(points.size()));
    points.positions.push_back(point.getVector3fMap());
    points.normals.push_back(point.getNormalVector3fMap());
  }
  return points;
}

void readSensors(const std::string& path, pcl::mrf::PointSet& points)
{
  std::ifstream file(path);
  for (Eigen::Vector3f sensor; file >> sensor.x() >> sensor.y() >> sensor.z();)
    points.sensors.push_back(sensor);
}

} // namespace

bool available()
{
  return std::ifstream(folder + "README.md").good();
}

Scan load(const std::string& name)
{
  // The diagonals of the complete objects, holes not yet cut.
  static const std::map<std::string, double> diagonals = {{"igea_clean", 0.156398728},
                                                          {"igea_noise", 0.156398728},
                                                          {"nefertiti", 658.054724},
                                                          {"bunny", 0.250246631},
                                                          {"bunny_raw", 0.250246631}};
  Scan scan;
  const std::string path = folder + name + "/";
  const auto input = readCloud(path + "input.ply");
  scan.points = pointsOf(input);
  const auto complete = diagonals.find(name);
  scan.diagonal =
      complete != diagonals.end() ? complete->second : pcl::mrf::boundingBox(scan.points.positions).diagonal();
  scan.heldOut = positionsOf(readCloud(path + "heldout.ply"));
  scan.clean = positionsOf(name == "igea_noise" ? readCloud(path + "clean.ply") : input);

  readSensors(path + "cameras.txt", scan.points);
  std::ifstream views(path + "views.txt");
  for (std::int32_t view; views >> view;)
    scan.points.views.push_back(view);
  return scan;
}

pcl::mrf::PointSet loadReal(const std::string& name)
{
  const std::string path = folder + "real/" + name + "/";
  pcl::mrf::PointSet points = pointsOf(readCloud(path + "input.ply"));
  readSensors(path + "sensors.txt", points);
  return points;
}

pcl::mrf::PointSet loadReference(const std::string& name)
{
  pcl::PointCloud<pcl::PointXYZ> cloud;
  if (pcl::io::loadPLYFile(folder + "reference/" + name + ".ply", cloud) < 0)
    throw std::runtime_error("cannot read the reference " + name);
  pcl::mrf::PointSet points;
  for (const pcl::PointXYZ& point : cloud)
    points.positions.push_back(point.getVector3fMap());
  return points;
}

} // namespace scans

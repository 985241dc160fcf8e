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
  scan.diagonal = diagonals.at(name);
  const std::string path = folder + name + "/";
  const auto input = readCloud(path + "input.ply");
  for (const pcl::PointNormal& point : input) {
    scan.points.origins.push_back(static_cast<std::uint32_t>(scan.points.size()));
    scan.points.positions.push_back(point.getVector3fMap());
    scan.points.normals.push_back(point.getNormalVector3fMap());
  }
  scan.heldOut = positionsOf(readCloud(path + "heldout.ply"));
  scan.clean = positionsOf(name == "igea_noise" ? readCloud(path + "clean.ply") : input);

  std::ifstream cameras(path + "cameras.txt");
  for (Eigen::Vector3f sensor; cameras >> sensor.x() >> sensor.y() >> sensor.z();)
    scan.points.sensors.push_back(sensor);
  std::ifstream views(path + "views.txt");
  for (std::int32_t view; views >> view;)
    scan.points.views.push_back(view);
  return scan;
}

} // namespace scans

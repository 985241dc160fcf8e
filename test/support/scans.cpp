// SPDX-License-Identifier: BSD-3-Clause
#include "support/scans.h"

#include "support/clouds.h"
#include "support/conversion.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <pcl/io/obj_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <scan/analytic_surface.h>
#include <scan/mesh_surface.h>
#include <scan/scan.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <stdexcept>

namespace scans {
namespace {

const std::string folder = std::string(MRF_SOURCE_DIR) + "/../shared/data/";
const std::string model = "/usr/share/glmark2/models/bunny.obj";

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
  for (const pcl::PointNormal& point : cloud)
    clouds::append(points, point.getVector3fMap(), point.getNormalVector3fMap());
  return points;
}

/// A surface of the triangles of an OBJ file.
pcl::mrf::scan::MeshSurface readModel()
{
  pcl::PolygonMesh file;
  if (pcl::io::loadOBJFile(model, file) < 0)
    throw std::runtime_error("cannot read " + model);
  const pcl::mrf::TriangleMesh mesh = conversion::plain(file);
  std::vector<Eigen::Vector3d> vertices;
  for (const Eigen::Vector3f& vertex : mesh.vertices)
    vertices.push_back(vertex.cast<double>());
  return {std::move(vertices), mesh.triangles};
}

bool isOfModel(const std::string& name)
{
  return name.rfind("model", 0) == 0;
}

bool isSimulated(const std::string& name)
{
  return isOfModel(name) || name == "table" || name == "street";
}

Scan simulate(const std::string& name)
{
  using namespace pcl::mrf::scan;
  ScanOptions options;
  if (isOfModel(name)) {
    options.holes = 3;
    options.smallestHole = options.largestHole = {3.5, Length::Unit::diagonalPercent};
    options.noise = {name == "model_noise" ? .25 : 0., Length::Unit::diagonalPercent};
    options.views.placement = name == "model_front" ? Placement::front : Placement::sphere;
    options.views.count = name == "model_front" ? 1 : 12;
  } else {
    options.sampling.pattern = Pattern::scanner;
    options.sensors = {name == "table" ? Eigen::Vector3d(0, .8, 2.5) : Eigen::Vector3d(0, 0, 1.8)};
  }
  if (name == "street") {
    options.sampling.points = 57600;
    options.sampling.axis = Eigen::Vector3d::UnitZ();
    options.sampling.aspect = 4.3;
    options.sampling.lowestElevation = -24.8;
    options.sampling.highestElevation = 2;
    options.noise = {.01, Length::Unit::cloud};
  }
  pcl::mrf::Execution execution(0);
  const pcl::mrf::scan::Scan seen = isOfModel(name)
                                        ? simulateScan(readModel(), options, execution)
                                        : simulateScan(AnalyticSurface(makeShape(name)), options, execution);
  scans::Scan scan;
  for (std::size_t i = 0; i < seen.cloud.size(); ++i)
    clouds::append(scan.points, seen.cloud.positions[i].cast<float>(), seen.cloud.normals[i].cast<float>());
  for (const Eigen::Vector3d& sensor : seen.sensors)
    scan.points.sensors.push_back(sensor.cast<float>());
  scan.points.views = seen.cloud.views;
  scan.heldOut = seen.heldOut.positions;
  scan.clean = seen.clean.positions;
  scan.diagonal = seen.diagonal;
  return scan;
}

void readSensors(const std::string& path, pcl::mrf::PointSet& points)
{
  std::ifstream file(path);
  for (Eigen::Vector3f sensor; file >> sensor.x() >> sensor.y() >> sensor.z();)
    points.sensors.push_back(sensor);
}

} // namespace

bool available(const std::string& name)
{
  if (isSimulated(name) && !isOfModel(name))
    return true;
  return std::ifstream(isOfModel(name) ? model : folder + "README.md").good();
}

std::vector<std::string> available(std::vector<std::string> names)
{
  names.erase(std::remove_if(names.begin(), names.end(), [](const std::string& name) { return !available(name); }),
              names.end());
  return names;
}

Scan load(const std::string& name)
{
  if (isSimulated(name))
    return simulate(name);
  // The diagonals of the complete objects, without holes.
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

  for (const char* sensors : {"cameras.txt", "sensors.txt"})
    readSensors(path + sensors, scan.points);
  std::ifstream views(path + "views.txt");
  for (std::int32_t view; views >> view;)
    scan.points.views.push_back(view);
  return scan;
}

} // namespace scans

std::vector<double> distancesToMesh(const std::vector<Eigen::Vector3d>& points, const pcl::mrf::TriangleMesh& mesh)
{
  using Kernel = CGAL::Simple_cartesian<double>;
  using Iterator = std::vector<Kernel::Triangle_3>::const_iterator;
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, Iterator>;
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

  std::vector<Kernel::Triangle_3> triangles;
  const auto corner = [&](std::int32_t v) {
    const Eigen::Vector3f& p = mesh.vertices[v];
    return Kernel::Point_3(p.x(), p.y(), p.z());
  };
  for (const pcl::mrf::Triangle& t : mesh.triangles)
    triangles.emplace_back(corner(t[0]), corner(t[1]), corner(t[2]));

  Tree tree(triangles.cbegin(), triangles.cend());
  tree.accelerate_distance_queries();
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const Eigen::Vector3d& p : points)
    distances.push_back(std::sqrt(tree.squared_distance(Kernel::Point_3(p.x(), p.y(), p.z()))));
  return distances;
}

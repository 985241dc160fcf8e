// SPDX-License-Identifier: BSD-3-Clause
#include "picture.h"

#include "float_offset.h"
#include "module.h"
#include "sensors.h"
#include "text_file.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <map>

namespace mrf_apps {
namespace {

/// The directions behind the names of a mesh's sides, in the columns: right, up, front.
Eigen::Matrix3d sidesOf(const SurfaceMesh& mesh, const std::vector<Eigen::Vector3d>& sensors)
{
  const Eigen::AlignedBox3d box = boxOf(mesh.vertices);
  const Eigen::Vector3d extent = box.sizes();
  const bool isCameraFrame =
      sensors.size() == 1 && sensors.front().norm() < 1e-6 * extent.norm() && box.center().normalized().z() > .7;
  const bool isFlat = extent.z() < .5 * std::min(extent.x(), extent.y());
  Eigen::Matrix3d sides = Eigen::Matrix3d::Identity();
  if (isCameraFrame)
    sides.col(1) = -Eigen::Vector3d::UnitY();
  else if (isFlat)
    sides.col(1) = Eigen::Vector3d::UnitZ();
  sides.col(2) = sides.col(0).cross(sides.col(1));
  return sides;
}

/// \param steepest maximum cosine between sight and up; beyond it the back or the front is up in the picture
PictureOptions viewAlong(const Eigen::Vector3d& sight, const Eigen::Matrix3d& sides, double steepest = .98)
{
  PictureOptions options;
  options.sight = sight.stableNormalized(); // its length is arbitrary
  const double rise = options.sight.dot(sides.col(1));
  options.up = sides.col(1);
  if (std::abs(rise) > steepest)
    options.up = std::copysign(1., rise) * sides.col(2);
  return options;
}

/// The view from a sensor; none if the sensor is amid the vertices and cannot see them all at once.
std::optional<PictureOptions> viewFrom(const Eigen::Vector3d& sensor, const SurfaceMesh& mesh,
                                       const Eigen::Matrix3d& sides)
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    sum += (vertex - sensor).normalized();
  if (!sensor.allFinite() || !(sum.norm() > 0))
    return {};
  PictureOptions options = viewAlong(sum, sides, .86);
  std::vector<double> angles;
  angles.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    angles.push_back(std::atan2(options.sight.cross(vertex - sensor).norm(), options.sight.dot(vertex - sensor)) * 180 /
                     M_PI);
  // A few stray pieces must not make the rest small.
  const auto last = angles.begin() + static_cast<std::ptrdiff_t>(.998 * static_cast<double>(angles.size() - 1));
  std::nth_element(angles.begin(), last, angles.end());
  constexpr double widest = 55, narrowest = .5; // degrees
  if (!(*last < widest))
    return {};
  if (*last < narrowest) // so far away that a nearer camera shows the same
    return options;
  options.viewpoint = sensor;
  options.viewAngle = 2 * 1.05 * *last;
  return options;
}

/// The unit direction out of the flattest side of the mesh; see writePicture.
Eigen::Vector3d outOfFlattestSide(const SurfaceMesh& mesh, const Eigen::Matrix3d& sides)
{
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), facing = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    mean += vertex / static_cast<double>(mesh.vertices.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    scatter += (vertex - mean) * (vertex - mean).transpose();
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d normal = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    facing += normal;
    area += normal.norm();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(scatter);
  const Eigen::Vector3d axis = principal.eigenvectors().col(0);
  const double share = axis.dot(facing) / area;
  if (std::abs(share) > .02)
    return std::copysign(1., share) * axis;
  const double flatness = std::sqrt(principal.eigenvalues()[0] / principal.eigenvalues()[1]);
  if (flatness > .6)
    return sides.col(2);
  return std::copysign(1., axis.dot(sides * Eigen::Vector3d(.3, .5, 1))) * axis;
}

PictureOptions viewOfFlattestSide(const SurfaceMesh& mesh, const Eigen::Matrix3d& sides)
{
  const Eigen::Vector3d out = outOfFlattestSide(mesh, sides);
  const PictureOptions straight = viewAlong(-out, sides);
  const Eigen::Vector3d right = straight.up.cross(out).normalized(), above = out.cross(right);
  const double rise = out.dot(sides.col(1)) > .7 ? -.3 : .3;
  PictureOptions options = viewAlong(-(out + .35 * right + rise * above), sides);
  options.up = straight.up;
  return options;
}

/// The direction to the camera for each name of a side, in the frame of sidesOf.
const std::map<std::string, Eigen::Vector3d> sidesByName = {{"front", {0, 0, 1}}, {"back", {0, 0, -1}},
                                                            {"left", {-1, 0, 0}}, {"right", {1, 0, 0}},
                                                            {"top", {0, 1, 0}},   {"bottom", {0, -1, 0}}};

PictureOptions viewOf(const SurfaceMesh& mesh, const std::vector<Eigen::Vector3d>& sensors, const std::string& camera)
{
  const Eigen::Matrix3d sides = sidesOf(mesh, sensors);
  if (camera.empty()) {
    const std::optional<PictureOptions> view =
        sensors.size() == 1 ? viewFrom(sensors.front(), mesh, sides) : std::nullopt;
    return view ? *view : viewOfFlattestSide(mesh, sides);
  }
  const auto named = sidesByName.find(camera);
  Eigen::Vector3d direction;
  if (named != sidesByName.end())
    direction = sides * named->second;
  else
    parseSensor(camera, direction);
  return viewAlong(-direction, sides);
}

const PictureRenderer& renderer()
{
  return shownBy<PictureRenderer>(MRF_PICTURE_MODULE, "pictureRenderer", "pictures");
}

} // namespace

const char* const cameraHelp =
    "where --picture looks from: a direction out of the mesh, or its front, back, left, right, top or bottom. Right is "
    "x; top is z and front -y of what is flat along z, else y and z, in the frame of a depth camera at the origin -y "
    "and "
    "-z. Default: a single sensor that is not amid the mesh, else across the "
    "flattest side, or, if nothing is flat, front";

std::string wrongCamera(const std::string& camera)
{
  Eigen::Vector3d direction;
  if (sidesByName.count(camera) > 0 || (parseSensor(camera, direction) && direction.norm() > 0))
    return {};
  return "is none of front, back, left, right, top, bottom and no direction X,Y,Z, such as 1,-1,0.5";
}

void requireDisplay()
{
  renderer().requireDisplay();
}

void writePicture(const SurfaceMesh& mesh, const std::vector<Eigen::Vector3d>& sensors, const std::string& camera,
                  const std::string& path)
{
  writeText(path, renderer().render(mesh, viewOf(mesh, sensors, camera)));
}

} // namespace mrf_apps

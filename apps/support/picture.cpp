// SPDX-License-Identifier: BSD-3-Clause
#include "picture.h"

#include "module.h"
#include "text_file.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace mrf_apps {
namespace {

/// Up for a camera that looks along a direction; see pictureFrom.
Eigen::Vector3d upFor(const Eigen::Vector3d& sensor, const Eigen::Vector3d& sight, const Eigen::Vector3d& extent)
{
  // Within 30 degrees of the picture's plane normal, up would say little.
  const auto isAcross = [&](int axis) { return std::abs(sight[axis]) < .86; };
  if (sensor.norm() < 1e-6 * extent.norm() && sight.z() > .7)
    return -Eigen::Vector3d::UnitY();
  const bool isFlatAlongZ = extent.z() < .5 * std::min(extent.x(), extent.y());
  return isAcross(2) && (isFlatAlongZ || !isAcross(1)) ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY();
}

const PictureRenderer& renderer()
{
  return shownBy<PictureRenderer>(MRF_PICTURE_MODULE, "pictureRenderer", "pictures");
}

} // namespace

PictureOptions pictureFrom(const Eigen::Vector3d& sensor, const SurfaceMesh& mesh)
{
  PictureOptions options;
  Eigen::AlignedBox3d box;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    box.extend(vertex);
    sum += (vertex - sensor).normalized();
  }
  if (!sensor.allFinite() || !(sum.norm() > 0))
    return options;
  const Eigen::Vector3d sight = sum.normalized();
  std::vector<double> angles;
  angles.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    angles.push_back(std::atan2(sight.cross(vertex - sensor).norm(), sight.dot(vertex - sensor)) * 180 / M_PI);
  // A few stray pieces must not make the rest small.
  const auto last = angles.begin() + static_cast<std::ptrdiff_t>(.998 * static_cast<double>(angles.size() - 1));
  std::nth_element(angles.begin(), last, angles.end());
  constexpr double widest = 55, narrowest = .1;
  if (!(*last < widest))
    return options;
  options.viewpoint = sensor;
  options.sight = sight;
  options.up = upFor(sensor, sight, box.sizes());
  options.viewAngle = 2 * std::max(1.05 * *last, narrowest);
  return options;
}

void requireDisplay()
{
  renderer().requireDisplay();
}

void writePicture(const SurfaceMesh& mesh, const PictureOptions& options, const std::string& path)
{
  writeText(path, renderer().render(mesh, options));
}

} // namespace mrf_apps

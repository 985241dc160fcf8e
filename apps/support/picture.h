// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Off-screen pictures of a mesh.
#pragma once

#include "surface_mesh.h"

#include <Eigen/Core>

#include <optional>
#include <string>

namespace mrf_apps {

/// \throw FileError naming xvfb-run if there is no X display that answers: Debian's VTK renders through one
void requireDisplay();

struct PictureOptions {
  /// Where the camera stands, in the mesh's frame, looking along `sight`. None: before the object, slightly above it
  /// and to the side, with the y axis up where the object is not much flatter along it than along z.
  std::optional<Eigen::Vector3d> viewpoint;
  Eigen::Vector3d sight = -Eigen::Vector3d::UnitZ(); ///< unit, from the viewpoint
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();     ///< seen from the viewpoint
  double viewAngle = 25;                             ///< degrees from bottom to top, above 0 and below 180
};

/// What a sensor saw, as it saw it: from its place, towards the vertices, the picture as wide as nearly all of them.
/// Up is -y for a camera's own frame (sensor at the origin, x to the right, y down, z forward), which is what depth
/// cameras deliver, else z where the object is flat along it and not seen along it, else y where it is not seen along
/// y. A sensor amid the object cannot see it at once: the options are the default ones then.
PictureOptions pictureFrom(const Eigen::Vector3d& sensor, const SurfaceMesh& mesh);

/// Renders the mesh with its vertex colors, or in one color, on a light background, into a PNG file.
/// \throw FileError, pcl::mrf::FileError
void writePicture(const SurfaceMesh& mesh, const PictureOptions& options, const std::string& path);

/// What pictures are rendered with: a module of its own, which is loaded when the first picture is asked for. VTK's
/// rendering would take a third of the time that a tool needs to start, and most runs write no picture.
struct PictureRenderer {
  void (*requireDisplay)();
  std::string (*render)(const SurfaceMesh& mesh, const PictureOptions& options); ///< the bytes of a PNG file
};

extern "C" const PictureRenderer pictureRenderer;

} // namespace mrf_apps

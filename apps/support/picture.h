// SPDX-License-Identifier: BSD-3-Clause
/// Off-screen pictures of a mesh.
#pragma once

#include "surface_mesh.h"

#include <Eigen/Core>

#include <optional>
#include <string>
#include <vector>

namespace mrf_apps {

/// \throw FileError naming xvfb-run if no X display answers: Debian's VTK needs one
void requireDisplay();

/// How a picture shows a mesh.
struct PictureOptions {
  std::optional<Eigen::Vector3d> viewpoint;          ///< of the camera; none: far enough away to show the whole mesh
  Eigen::Vector3d sight = -Eigen::Vector3d::UnitZ(); ///< unit, from the camera
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();     ///< in the picture
  double viewAngle = 25;                             ///< degrees from bottom to top, above 0 and below 180
};

/// Help of --camera.
extern const char* const cameraHelp;

/// The error of a value of --camera, worded to follow it; empty if it is valid.
std::string wrongCamera(const std::string& camera);

/// Renders the mesh with its vertex colors, or in one color, on a light background, into a PNG file.
/// \param camera a value of --camera. Empty: the view of a single sensor, as wide as nearly all vertices. Without a
/// single sensor, or if it stands amid the vertices, the flattest side is shown: along the smallest principal axis,
/// from the side that the triangles face. If they face both sides alike: from the front if the mesh is not flat, else
/// from the end of the axis that is nearer to the front, the top or the right. The camera is moved somewhat up and to
/// the right, so that the depth shows. \throw FileError, pcl::mrf::FileError
void writePicture(const SurfaceMesh& mesh, const std::vector<Eigen::Vector3d>& sensors, const std::string& camera,
                  const std::string& path);

/// Renders pictures: a module of its own, which is loaded for the first picture. VTK's rendering would take a third of
/// the time that a tool needs to start, and most runs write no picture.
struct PictureRenderer {
  void (*requireDisplay)();
  std::string (*render)(const SurfaceMesh& mesh, const PictureOptions& options); ///< the bytes of a PNG file
};

extern "C" const PictureRenderer pictureRenderer;

} // namespace mrf_apps

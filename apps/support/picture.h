// SPDX-License-Identifier: BSD-3-Clause
/// Off-screen pictures of a mesh.
#pragma once

#include "surface_mesh.h"

#include <Eigen/Core>

#include <optional>
#include <string>
#include <vector>

namespace mrf_apps {

/// \throw FileError naming xvfb-run if there is no X display that answers: Debian's VTK renders through one
void requireDisplay();

/// How a picture shows a mesh.
struct PictureOptions {
  std::optional<Eigen::Vector3d> viewpoint; ///< where the camera stands; none: so far away that all is in the picture
  Eigen::Vector3d sight = -Eigen::Vector3d::UnitZ(); ///< unit, from the camera
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();     ///< in the picture
  double viewAngle = 25;                             ///< degrees from bottom to top, above 0 and below 180
};

/// What --camera takes, for its help.
extern const char* const cameraHelp;

/// What is wrong with a value of --camera; empty: nothing.
std::string wrongCamera(const std::string& camera);

/// \param camera a value of --camera. Empty: what a single sensor saw, as it saw it, from its place and as wide as
/// nearly all vertices. Without one, or if it stands amid them: onto the flattest side, along the smallest principal
/// axis from where the triangles face; if they face all around, from the front of what is flat along no axis, else from
/// the front, the top or the right; somewhat from above and from the right, so that the depth shows.
PictureOptions viewOf(const SurfaceMesh& mesh, const std::vector<Eigen::Vector3d>& sensors, const std::string& camera);

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

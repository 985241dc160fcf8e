/// \file
/// \brief Off-screen pictures of a mesh.
#pragma once

#include "surface_mesh.h"

#include <Eigen/Core>

#include <string>

namespace mrf_apps {

/// \throw FileError naming xvfb-run if there is no X display that answers: Debian's VTK renders through one
void requireDisplay();

struct PictureOptions {
  int width = 1000, height = 1000;
  /// Where the camera is, seen from the object, and which way is up. Zero: from the front, slightly from above and the
  /// side, with the y axis up where the object is not much flatter along it than along z.
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
};

/// Renders the mesh with its vertex colours, or in one colour, on a light background, into a PNG file.
/// \throw FileError
void writePicture(const SurfaceMesh& mesh, const PictureOptions& options, const std::string& path);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Off-screen pictures of a mesh.
#pragma once

#include "surface_mesh.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mrf_apps {

/// \throw FileError naming xvfb-run if there is no X display that answers: Debian's VTK renders through one
void requireDisplay();

/// A bar of colors with its values, in a strip below the picture proper.
struct Legend {
  std::string title;
  double lower = 0, upper = 1;
  std::vector<std::array<std::uint8_t, 3>> colors; ///< evenly spaced from lower to upper; empty: no legend
};

/// Share of the picture's height that a legend takes.
constexpr double legendHeight = .12;

struct PictureOptions {
  int width = 1000, height = 1000;
  /// Where the camera is, seen from the object, and which way is up. Zero: from the front, slightly from above and the
  /// side, with the y axis up where the object is not much flatter along it than along z.
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  double extent = 0; ///< what the picture's height above a legend spans, cloud's unit; 0 = the whole object
  std::optional<Eigen::Vector3d>
      focus; ///< with an extent: the place in the middle, in the mesh's frame; none: its box's
  /// Where the camera stands, in the mesh's frame, instead of `from`; it looks along `sight` then, and `extent` and
  /// `focus` are not used.
  std::optional<Eigen::Vector3d> viewpoint;
  Eigen::Vector3d sight = -Eigen::Vector3d::UnitZ(); ///< unit, from the viewpoint
  double viewAngle = 25;                             ///< degrees from bottom to top, above 0 and below 180
  bool showEdges = false;                            ///< of the triangles
  Legend legend;
};

/// What a sensor saw, as it saw it: from its place, towards the vertices, the picture as wide as nearly all of them.
/// Up is -y for a camera's own frame (sensor at the origin, x to the right, y down, z forward), which is what depth
/// cameras deliver, else z where the object is flat along it and not seen along it, else y where it is not seen along
/// y. A sensor amid the object cannot see it at once: the options are the default ones then.
PictureOptions pictureFrom(const Eigen::Vector3d& sensor, const SurfaceMesh& mesh);

/// Renders the mesh with its vertex colors, or in one color, on a light background, into a PNG file.
/// \throw FileError
void writePicture(const SurfaceMesh& mesh, const PictureOptions& options, const std::string& path);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What pictures are rendered with: a module of its own, which is loaded when the first picture is asked for.
///
/// VTK's rendering would take a third of the time that a tool needs to start, and most runs write no picture.
#pragma once

#include "picture.h"

namespace mrf_apps {

/// What picture.h says of its functions. Both throw FileError.
struct PictureRenderer {
  void (*requireDisplay)();
  void (*write)(const SurfaceMesh& mesh, const PictureOptions& options, const std::string& path);
};

extern "C" const PictureRenderer pictureRenderer;

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What pictures are rendered with: a module of its own, which is loaded when the first picture is asked for.
///
/// VTK's rendering would take a third of the time that a tool needs to start, and most runs write no picture.
#pragma once

#include "picture.h"

namespace mrf_apps {

/// What picture.h says of its functions.
struct PictureRenderer {
  void (*requireDisplay)();
  std::string (*render)(const SurfaceMesh& mesh, const PictureOptions& options); ///< the bytes of a PNG file
};

extern "C" const PictureRenderer pictureRenderer;

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Meshes as files of scenes, for browsers, editors and printers.
#pragma once

#include "surface_mesh.h"

#include <string>

namespace mrf_apps {

/// Assimp, in a module of its own, which is loaded when the first such file is written.
struct SceneWriter {
  /// The bytes of a file of glTF 2.0, COLLADA or 3MF, the last without colors.
  /// \param offset subtracted from the vertices, which are floats there \param format glb, dae or 3mf
  /// \throw FileError
  std::string (*bytesOf)(const SurfaceMesh& mesh, const Eigen::Vector3d& offset, const std::string& format);
};

constexpr const char* sceneModule = "libpcl_mrf_scenes.so";
extern "C" const SceneWriter sceneWriter;

} // namespace mrf_apps

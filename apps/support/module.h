// SPDX-License-Identifier: BSD-3-Clause
/// Modules that a tool loads only when it needs them: at each start they would take longer than everything else.
#pragma once

#include "errors.h"
#include "surface_mesh.h"

#include <base/module.h>

#include <string>

namespace mrf_apps {

/// The object that a module exports under a name; the module stays loaded. \param lost who needs it, a plural
/// \throw FileError if it cannot be loaded
template <typename Shown>
const Shown& shownBy(const char* module, const char* name, const char* lost)
{
  const void* const found = pcl::mrf::shownByModule(module, name);
  if (found == nullptr)
    throw FileError(std::string(lost) +
                    " need a module of the package pcl-mrf-tools, which cannot be loaded: " + dlerror());
  return *static_cast<const Shown*>(found);
}

/// Writes meshes as scene files by Assimp, for browsers, editors and printers.
struct SceneWriter {
  /// The bytes of a glTF 2.0, COLLADA or 3MF file; 3MF without colors.
  /// \param offset subtracted from the vertices before they are rounded to float \param format glb, dae or 3mf
  /// \throw FileError
  std::string (*bytesOf)(const SurfaceMesh& mesh, const Eigen::Vector3d& offset, const std::string& format);
};

constexpr const char* sceneModule = "libpcl_mrf_scenes.so";
extern "C" const SceneWriter sceneWriter;

} // namespace mrf_apps

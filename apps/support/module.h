// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Modules that a tool loads when it needs them: at each start they would take longer than all else.
#pragma once

#include "errors.h"

#include <dlfcn.h>

#include <string>

namespace mrf_apps {

/// What a module shows under a name; it stays loaded. \param lost without it, for the message
/// \throw FileError if it cannot be loaded
template <typename Shown>
const Shown& shownBy(const char* module, const char* name, const char* lost)
{
  void* const loaded = dlopen(module, RTLD_NOW | RTLD_LOCAL);
  const void* const found = loaded == nullptr ? nullptr : dlsym(loaded, name);
  if (found == nullptr)
    throw FileError(std::string("no ") + lost +
                    ", as their module, of the package pcl-mrf-tools, cannot be loaded: " + dlerror());
  return *static_cast<const Shown*>(found);
}

} // namespace mrf_apps

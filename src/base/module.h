// SPDX-License-Identifier: BSD-3-Clause
/// Modules that the library loads while it runs.
#pragma once

#include <dlfcn.h>

#include <string>

namespace pcl::mrf {

/// What a module shows under a name: the one beside the library, or the program it is a part of, else one where the
/// system looks for libraries. It stays loaded. \param name a constant of the library \param visibility RTLD_LOCAL, or
/// RTLD_GLOBAL if what it loads looks for its names \return null if there is none, and dlerror() tells why
inline void* shownByModule(const std::string& file, const char* name, int visibility = RTLD_LOCAL)
{
  void* module = nullptr;
  Dl_info self;
  if (dladdr(name, &self) != 0) {
    const std::string path = self.dli_fname;
    module = dlopen((path.substr(0, path.rfind('/') + 1) + file).c_str(), RTLD_NOW | visibility);
  }
  if (module == nullptr)
    module = dlopen(file.c_str(), RTLD_NOW | visibility);
  return module == nullptr ? nullptr : dlsym(module, name);
}

} // namespace pcl::mrf

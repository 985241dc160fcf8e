// SPDX-License-Identifier: BSD-3-Clause
/// Modules that the library loads while it runs.
#pragma once

#include <dlfcn.h>

#include <string>

namespace pcl::mrf {

/// The address of a symbol of a module. The module is looked for beside the library, or beside the program that
/// contains it, then where the system looks for libraries; it stays loaded.
/// \param name a string constant of the library \param visibility RTLD_LOCAL, or RTLD_GLOBAL if libraries that the
/// module loads need its symbols \return null on failure; dlerror() tells why
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

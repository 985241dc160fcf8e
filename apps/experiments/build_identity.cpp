// SPDX-License-Identifier: BSD-3-Clause
#include "build_identity.h"

#include "support/errors.h"

#include <link.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>

namespace mrf_apps {

std::vector<std::string> filesOfBuild()
{
  std::vector<std::string> files = {"/proc/self/exe"};
  const auto addLibrary = [](dl_phdr_info* object, std::size_t, void* found) {
    const std::string path = object->dlpi_name;
    if (std::filesystem::path(path).filename().string().rfind("libpcl_mrf.", 0) == 0)
      static_cast<std::vector<std::string>*>(found)->push_back(path);
    return 0;
  };
  dl_iterate_phdr(addLibrary, &files);
  return files;
}

std::string identityOf(const std::vector<std::string>& files)
{
  // FNV-1a: nobody forges a build.
  std::uint64_t hash = 0xcbf29ce484222325;
  const auto add = [&hash](char byte) { hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3; };
  for (const std::string& path : files) {
    std::ifstream file(path, std::ios::binary);
    std::array<char, 1 << 16> block;
    while (file.read(block.data(), block.size()), file.gcount() > 0)
      for (std::streamsize i = 0; i < file.gcount(); ++i)
        add(block[static_cast<std::size_t>(i)]);
    if (!file.eof())
      throw FileError(path, "cannot be read to tell this build from others");
    add(0); // so that bytes cannot wander from one file to the next unseen
  }
  std::array<char, 17> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(hash));
  return digits.data();
}

} // namespace mrf_apps

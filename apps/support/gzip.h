// SPDX-License-Identifier: BSD-3-Clause
/// What gzip has packed.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mrf_apps {

/// Whether bytes begin as gzip's files do, and as no other file that is read.
bool isGzip(std::string_view bytes);

/// What is packed in a file, in one or several parts. \param path for messages
/// \throw FileError if it is truncated or corrupt, or would unpack to more than the limit, in bytes
std::string unpackGzip(const std::string& path, std::string_view packed, std::size_t limit);

} // namespace mrf_apps

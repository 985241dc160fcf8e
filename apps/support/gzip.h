// SPDX-License-Identifier: BSD-3-Clause
/// Unpacks gzip files.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mrf_apps {

/// True if the bytes begin as gzip files do. No other file type that is read begins so.
bool isGzip(std::string_view bytes);

/// The unpacked bytes of a gzip file of one or several parts. \param path for messages
/// \throw FileError if it is truncated or corrupt, or would unpack to more than the limit, in bytes
std::string unpackGzip(const std::string& path, std::string_view packed, std::size_t limit);

} // namespace mrf_apps

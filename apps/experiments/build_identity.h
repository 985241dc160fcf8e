// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Which build of the program is running: results of another one are not its own.
#pragma once

#include <string>
#include <vector>

namespace mrf_apps {

/// The files that the running program's own code is in: the program's and, if it is a shared one, the library's.
/// PCL and other libraries of the system are none of them.
std::vector<std::string> filesOfBuild();

/// 16 hexadecimal digits that change with any byte of the files. \throw FileError if one cannot be read
std::string identityOf(const std::vector<std::string>& files);

} // namespace mrf_apps

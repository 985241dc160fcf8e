// SPDX-License-Identifier: BSD-3-Clause
/// Failures of the tools, each kind with its own exit status.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace mrf_apps {

/// Exit statuses of all tools.
enum ExitStatus { exitDone = 0, exitFile = 1, exitUsage = 2, exitMethod = 3 };

/// A message in one line: what it quotes, a file or a word of the command line, may hold anything.
inline std::string withoutControls(std::string text)
{
  for (char& c : text)
    if ((c >= 0 && c < ' ') || c == '\x7f')
      c = '?';
  return text;
}

/// Something about a file or the display; the message names the file and the cause in one line.
class FileError : public std::runtime_error {
public:
  explicit FileError(const std::string& message) : std::runtime_error(message) {}
  FileError(const std::string& path, const std::string& cause)
      : std::runtime_error("'" + path + "': " + withoutControls(cause))
  {}
  FileError(const std::string& path, std::size_t line, const std::string& cause)
      : FileError(path, "line " + std::to_string(line) + ": " + cause)
  {}
};

/// The command line asks for something that does not exist or does not go together; the message is one line.
class UsageError : public std::runtime_error {
public:
  explicit UsageError(const std::string& message) : std::runtime_error(withoutControls(message)) {}
};

/// \throw UsageError with the message
inline void requireUsage(bool holds, const std::string& message)
{
  if (!holds)
    throw UsageError(message);
}

} // namespace mrf_apps

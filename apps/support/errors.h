// SPDX-License-Identifier: BSD-3-Clause
/// Failures of the tools, each kind with its own exit status.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace mrf_apps {

/// Exit statuses of all tools.
enum ExitStatus { exitDone = 0, exitFile = 1, exitUsage = 2, exitMethod = 3 };

/// A message in one line, with "\n" for a line break and "\x1b" for escape: what it quotes, a name of a file or a word
/// of the command line, may hold anything.
inline std::string escaped(const std::string& text)
{
  constexpr const char* digits = "0123456789abcdef";
  std::string line;
  for (const char c : text)
    if (c == '\n')
      line += "\\n";
    else if ((c >= 0 && c < ' ') || c == '\x7f')
      line += {'\\', 'x', digits[c / 16], digits[c % 16]};
    else
      line += c;
  return line;
}

/// Something about a file or the display; the message names the file and the cause in one line.
class FileError : public std::runtime_error {
public:
  explicit FileError(const std::string& message) : std::runtime_error(escaped(message)) {}
  FileError(const std::string& path, const std::string& cause) : FileError("'" + path + "': " + cause) {}
  FileError(const std::string& path, std::size_t line, const std::string& cause)
      : FileError(path, "line " + std::to_string(line) + ": " + cause)
  {}
};

/// The command line asks for something that does not exist or does not go together; the message is one line.
class UsageError : public std::runtime_error {
public:
  explicit UsageError(const std::string& message) : std::runtime_error(escaped(message)) {}
};

/// \throw UsageError with the message
inline void requireUsage(bool holds, const std::string& message)
{
  if (!holds)
    throw UsageError(message);
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// The errors of the tools, each kind with its own exit status.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace mrf_apps {

/// Exit statuses of all tools.
enum ExitStatus { exitDone = 0, exitFile = 1, exitUsage = 2, exitMethod = 3 };

/// The text in one line, with escapes such as "\n" and "\x1b" for control characters: a message quotes names of files
/// and words of the command line, which may hold any character.
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

/// An error of a file or of the display; the message names the file and the cause in one line.
class FileError : public std::runtime_error {
public:
  explicit FileError(const std::string& message) : std::runtime_error(escaped(message)) {}
  FileError(const std::string& path, const std::string& cause) : FileError("'" + path + "': " + cause) {}
  FileError(const std::string& path, std::size_t line, const std::string& cause)
      : FileError(path, "line " + std::to_string(line) + ": " + cause)
  {}
};

/// An error in the command line: something unknown, or options that exclude each other; the message is one line.
class UsageError : public std::runtime_error {
public:
  explicit UsageError(const std::string& message) : std::runtime_error(escaped(message)) {}
};

/// What a command line throws that asks for a text alone, such as the help; it is printed and is no error.
struct Information {
  std::string text;
};

/// \throw UsageError with the message unless the condition holds
inline void requireUsage(bool holds, const std::string& message)
{
  if (!holds)
    throw UsageError(message);
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Output files that appear all together and whole, or not at all.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace mrf_apps {

/// A set of files to be written. Each is written to a temporary file beside its target; `publish` renames them all.
/// Whatever was not published is removed with the object. Where the file system has files without a name the temporary
/// ones are such, and not even a crash leaves them behind.
class OutputFiles {
public:
  OutputFiles();
  ~OutputFiles();
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;

  /// Declares a file, before any work: creates its temporary file to see that this can be done.
  /// "-" is standard output, whose temporary file lies in the system's folder for such. Symbolic links are followed, to
  /// files that do not exist yet as well. \throw FileError if the folder is missing or cannot be written to, or the
  /// target is not a regular file \throw UsageError if two outputs are the same file
  void add(const std::string& path);

  /// Has a declared file written: `writer` is given the path to write to.
  /// \return bytes written; \throw FileError naming the target if the writer fails or nothing is there afterwards
  std::int64_t write(const std::string& path, const std::function<void(const std::string& temporary)>& writer);

  /// Copies to standard output what is for it, then renames every file to its target. \throw FileError
  void publish();

private:
  class File;
  std::vector<File> files_;
};

/// \throw UsageError if an output is one of the inputs and would overwrite it; empty paths are none,
/// nor is "-"
void refuseInputAsOutput(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

/// True if both paths lead to the same existing file.
bool sameFile(const std::string& a, const std::string& b);

} // namespace mrf_apps

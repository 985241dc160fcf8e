// SPDX-License-Identifier: BSD-3-Clause
/// Output files that appear all together and whole, or not at all.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace mrf_apps {

struct TemporaryFile;

/// A set of files to be written. Each is written to a temporary file beside its target; `publish` renames them all.
/// Files that are not published are removed by the destructor, or by a signal that ends the process. Empty paths are
/// ignored.
class OutputFiles {
public:
  OutputFiles() = default;
  ~OutputFiles();
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;

  /// Declares a file before any work. Creates its temporary file, to find out early if that fails. "-" is standard
  /// output. Links are followed. \throw FileError if the folder is missing or cannot be written to, or the target is
  /// not a regular file \throw UsageError if two outputs are the same file
  void add(const std::string& path);

  /// Writes a declared file by `writer`, which gets the path of the temporary file.
  /// \return bytes written; \throw FileError naming the target if the writer throws pcl::mrf::FileError
  std::int64_t write(const std::string& path, const std::function<void(const std::string& temporary)>& writer);

  /// Copies the output for "-" to standard output, then renames every file to its target. \throw FileError
  void publish();

private:
  struct File {
    std::string path, target;
    TemporaryFile* temporary = nullptr;
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> spool{nullptr, &std::fclose}; ///< holds the output for "-"
  };
  std::vector<File> files_;
};

/// Makes a folder and its parents unless they exist. \throw FileError
void makeFolder(const std::string& folder);

/// \throw UsageError if an output is one of the inputs and would overwrite it; empty paths and "-" are ignored
void refuseInputAsOutput(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

/// From now on a signal that ends the process removes the temporary files first. Ignored signals stay ignored. If the
/// reader of standard output is gone, or a file exceeds its size limit, the writing call fails and the process goes on.
void removeTemporaryFilesOnSignals();

/// Signal handler: removes the temporary files, then does what the signal does by default.
void endBySignal(int signal);

} // namespace mrf_apps

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
/// Whatever was not published is removed with the object, or by the signal that ends the process. An empty path is no
/// file: nothing is done about it.
class OutputFiles {
public:
  OutputFiles() = default;
  ~OutputFiles();
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;

  /// Declares a file, before any work: creates its temporary file to see that this can be done. "-" is standard output.
  /// Links are followed. \throw FileError if the folder is missing or cannot be written to, or the target is not a
  /// regular file \throw UsageError if two outputs are the same file
  void add(const std::string& path);

  /// Has a declared file written: `writer` is given the path to write to.
  /// \return bytes written; \throw FileError naming the target if the writer throws pcl::mrf::FileError
  std::int64_t write(const std::string& path, const std::function<void(const std::string& temporary)>& writer);

  /// Copies to standard output what is for it, then renames every file to its target. \throw FileError
  void publish();

private:
  struct File {
    std::string path, target;
    TemporaryFile* temporary = nullptr;
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> spool{nullptr, &std::fclose}; ///< of standard output
  };
  std::vector<File> files_;
};

/// Makes a folder, and those that it is in, unless it is there. \throw FileError
void makeFolder(const std::string& folder);

/// \throw UsageError if an output is one of the inputs and would overwrite it; empty paths are none, nor is "-"
void refuseInputAsOutput(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs);

/// From now on a signal that ends the process removes the temporary files first. Signals that are ignored stay so.
/// A reader of the standard output that goes away, and files beyond the limit of their size, are errors of the writing
/// call instead of the end of the process.
void removeTemporaryFilesOnSignals();

/// Handler of a signal: removes the temporary files, then does what the signal does by default.
void endBySignal(int signal);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// Every reader of files and of command lines as a function of bytes, for fuzzers and for replaying what they
/// found.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace fuzz {

/// How a file of a format ends that a reader knows, and what it is read as.
struct Reader {
  const char* name; ///< as in the file names of the corpus: name-whatever
  void (*read)(const std::string& bytes);
  std::size_t largestRatio; ///< of memory to the file's size; those that unpack have what they unpack
};

/// All readers: points-xyz, mesh-stl, command-scan, and so on.
const std::vector<Reader>& readers();

/// Ends the process, with a message, if the condition does not hold.
void require(bool condition, const char* what);

// Of command_readers.cpp.
/// The lines are the words of a command line. \throw mrf_apps::UsageError
void readReconstructionCommand(const std::string& lines);
void readEvaluationCommand(const std::string& lines);
void readScanCommand(const std::string& lines);

/// Runs a reader. What it throws must be an error of one line, a FileError that names the file, or of usage, and what
/// it returns must be consistent; ends the process otherwise.
/// \return true if the bytes were read
bool runReader(const Reader& reader, const std::string& bytes);

} // namespace fuzz

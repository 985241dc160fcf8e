/// \file
/// \brief Every reader of files as a function of bytes, for fuzzers and for replaying what they found.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace fuzz {

/// How a file of a format ends that a reader knows, and what it is read as.
struct Reader {
  const char* name; ///< as in the file names of the corpus: name-whatever
  void (*read)(const std::string& bytes);
  std::size_t largestRatio; ///< of memory to the file's size; those that unpack have what they unpack
};

/// All readers: points-xyz, mesh-vtk, and so on.
const std::vector<Reader>& readers();

/// Runs a reader. What it throws must be a FileError of one line that names the file, and what it returns must be
/// consistent; ends the process otherwise.
/// \return true if the file was read
bool runReader(const Reader& reader, const std::string& bytes);

} // namespace fuzz

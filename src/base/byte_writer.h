// SPDX-License-Identifier: BSD-3-Clause
/// Writes binary files block by block, without the whole file in memory and without a system call per number.
#pragma once

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include <unistd.h>

namespace pcl::mrf {

enum class ByteOrder { little, big };

/// Writes a file, replacing an old one. All functions throw FileError, without the path, if it cannot be written. The
/// machine must be little-endian, as for PCL's own files.
class ByteWriter {
public:
  explicit ByteWriter(const std::string& path, ByteOrder order = ByteOrder::little)
      : file_(path, std::ios::binary | std::ios::trunc), order_(order)
  {
    requireWritten();
    block_.reserve(2 * blockBytes);
  }

  void text(const std::string& characters)
  {
    block_ += characters;
    writeFullBlock();
  }

  template <typename T>
  void value(T number)
  {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &number, sizeof(T));
    if (order_ == ByteOrder::big)
      std::reverse(bytes.begin(), bytes.end());
    block_.append(bytes.data(), bytes.size());
    writeFullBlock();
  }

  /// Call it after the last value.
  void close()
  {
    write();
    file_.close();
    requireWritten();
  }

private:
  static constexpr std::size_t blockBytes = 1 << 16;

  void requireWritten() const
  {
    if (!file_)
      throw FileError(std::string("could not be written: ") + std::strerror(errno));
  }

  void write()
  {
    file_.write(block_.data(), static_cast<std::streamsize>(block_.size()));
    block_.clear();
    requireWritten();
  }

  void writeFullBlock()
  {
    if (block_.size() >= blockBytes)
      write();
  }

  std::ofstream file_;
  std::string block_;
  ByteOrder order_;
};

/// Writes a file under another name in the same folder, then renames it. \param target no link
/// \throw what the writer throws, std::filesystem::filesystem_error; then nothing is left of the file
template <typename Writer>
void writeWhole(const std::filesystem::path& target, const Writer& writer)
{
  const std::string temporary = target.string() + "." + std::to_string(getpid()) + ".part";
  try {
    writer(temporary);
    std::filesystem::rename(temporary, target);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw;
  }
}

} // namespace pcl::mrf

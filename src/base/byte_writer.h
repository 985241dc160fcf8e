// SPDX-License-Identifier: BSD-3-Clause
/// Files written as bytes, block by block: neither the whole file in memory nor a call for each number.
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

/// Replaces a file. All functions throw FileError, without the path, if it cannot be written. The machine is
/// little-endian, as PCL's own files are.
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

  /// When all is written.
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

/// Has a file written under another name in the same folder, and renamed when it is whole. \param target no link
/// \throw what the writer does, std::filesystem::filesystem_error; nothing is left of the file then
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

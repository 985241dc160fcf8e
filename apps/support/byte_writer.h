// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Files written as bytes, block by block: neither the whole file in memory nor a call for each number.
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace mrf_apps {

/// Replaces a file. All functions throw FileError if the file cannot be written. The machine is little-endian, as
/// everything is that PCL and Debian's VTK write here.
class ByteWriter {
public:
  /// \throw FileError if the file cannot be opened
  explicit ByteWriter(const std::string& path);

  void text(std::string_view string)
  {
    while (string.size() > room()) {
      const std::size_t fitting = room();
      append(string.data(), fitting);
      string.remove_prefix(fitting);
      flush();
    }
    append(string.data(), string.size());
  }

  template <typename T>
  void value(T number)
  {
    if (room() < sizeof(T))
      flush();
    append(reinterpret_cast<const char*>(&number), sizeof(T));
  }

  /// Shortest text that reads back as the same number.
  template <typename T>
  void decimal(T number)
  {
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number);
    text({digits.data(), static_cast<std::size_t>(end.ptr - digits.data())});
  }

  /// Must be called when all is written. \throw FileError if anything could not be
  void close();

private:
  std::size_t room() const { return buffer_.size() - used_; }
  void append(const char* bytes, std::size_t count)
  {
    std::memcpy(buffer_.data() + used_, bytes, count);
    used_ += count;
  }
  void flush();

  std::ofstream file_;
  std::vector<char> buffer_;
  std::size_t used_ = 0;
};

} // namespace mrf_apps

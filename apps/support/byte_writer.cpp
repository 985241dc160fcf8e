// SPDX-License-Identifier: BSD-3-Clause
#include "byte_writer.h"

#include "errors.h"

#include <cerrno>

namespace mrf_apps {
namespace {

constexpr std::size_t blockBytes = std::size_t{1} << 20;

[[noreturn]] void fail()
{
  throw FileError(std::string("could not be written: ") + std::strerror(errno));
}

} // namespace

ByteWriter::ByteWriter(const std::string& path) : file_(path, std::ios::binary | std::ios::trunc), buffer_(blockBytes)
{
  if (!file_)
    fail();
}

void ByteWriter::flush()
{
  file_.write(buffer_.data(), static_cast<std::streamsize>(used_));
  used_ = 0;
  if (!file_)
    fail();
}

void ByteWriter::close()
{
  flush();
  file_.close();
  if (!file_)
    fail();
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "gzip.h"

#include "errors.h"

#define ZLIB_CONST // the input is const
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <new>

namespace mrf_apps {

bool isGzip(std::string_view bytes)
{
  return bytes.substr(0, 3) == "\x1f\x8b\x08";
}

std::string unpackGzip(const std::string& path, std::string_view packed, std::size_t limit)
{
  constexpr int windowBits = 15, gzip = 16;
  z_stream stream = {};
  if (inflateInit2(&stream, windowBits + gzip) != Z_OK)
    throw std::bad_alloc();
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, &inflateEnd);
  std::string unpacked, block(1 << 16, '\0');
  // The last four bytes are the unpacked size of the last part modulo 2^32, which is reserved at once. A packed byte
  // unpacks to at most 1032 bytes.
  std::uint32_t size = 0;
  if (packed.size() >= sizeof(size))
    std::memcpy(&size, packed.data() + packed.size() - sizeof(size), sizeof(size));
  unpacked.reserve(std::min({std::size_t{size}, limit, 1032 * packed.size()}) + block.size());
  do { // a part: its header, what is packed, and its checksum
    int status = inflateReset(&stream);
    while (status == Z_OK && unpacked.size() <= limit) {
      const std::size_t offered = std::min<std::size_t>(packed.size(), std::numeric_limits<uInt>::max());
      stream.next_in = reinterpret_cast<const Bytef*>(packed.data());
      stream.avail_in = static_cast<uInt>(offered);
      stream.next_out = reinterpret_cast<Bytef*>(block.data());
      stream.avail_out = static_cast<uInt>(block.size());
      status = inflate(&stream, Z_NO_FLUSH); // Z_BUF_ERROR if the input ends here
      unpacked.append(block, 0, block.size() - stream.avail_out);
      packed.remove_prefix(offered - stream.avail_in);
    }
    if (unpacked.size() > limit)
      throw FileError(path, "unpacks to more than " + std::to_string(limit >> 20) +
                                " MiB, an eighth of the free memory: unpack it by gunzip if that is meant");
    if (status == Z_MEM_ERROR)
      throw std::bad_alloc();
    if (status != Z_STREAM_END)
      throw FileError(path, status == Z_BUF_ERROR ? "is truncated: what gzip packed does not end; copy it anew"
                                                  : "is a corrupt file of gzip; copy it anew");
  } while (isGzip(packed));
  if (packed.find_first_not_of('\0') != std::string_view::npos) // tape archives end in zeros
    throw FileError(path, "is a corrupt file of gzip: other bytes follow what is packed; copy it anew");
  return unpacked;
}

} // namespace mrf_apps

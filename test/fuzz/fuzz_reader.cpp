// SPDX-License-Identifier: BSD-3-Clause
// Runs a reader under libFuzzer; the reader is chosen at compile time.
#include "fuzz/readers.h"

#include <algorithm>
#include <cstring>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
  static const fuzz::Reader& reader =
      *std::find_if(fuzz::readers().begin(), fuzz::readers().end(),
                    [](const fuzz::Reader& candidate) { return std::strcmp(candidate.name, MRF_FUZZ_READER) == 0; });
  fuzz::runReader(reader, std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}

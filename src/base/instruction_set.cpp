// SPDX-License-Identifier: BSD-3-Clause
#include "base/multiversioning.h"

#include <algorithm>
#include <cstdlib>

namespace pcl::mrf {
namespace {

InstructionSet ofProcessor()
{
#ifdef MRF_HAS_MULTIVERSIONING
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f"))
    return InstructionSet::avx512;
  if (__builtin_cpu_supports("avx2"))
    return InstructionSet::avx2;
#endif
  return InstructionSet::baseline;
}

InstructionSet ofEnvironment()
{
  const char* limit = std::getenv("MRF_SIMD");
  return widestInstructionSet(limit != nullptr ? limit : "");
}

} // namespace

InstructionSet widestInstructionSet(const std::string& limit)
{
  const InstructionSet widest = ofProcessor();
  if (limit == "baseline")
    return InstructionSet::baseline;
  return limit == "avx2" ? std::min(widest, InstructionSet::avx2) : widest;
}

// Before its initialization it is zero, the baseline.
InstructionSet instructionSet = ofEnvironment();

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The instruction set that the hot loops use.
#pragma once

#include <string>

/// Other processors and compilers, and builds with sanitizers, have the plain loops only.
#if !defined(MRF_NO_MULTIVERSIONING) && defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MRF_HAS_MULTIVERSIONING
#endif

namespace pcl::mrf {

/// Those that the loops are compiled for, each with all of the ones before it.
enum class InstructionSet { baseline, avx2, avx512 };

/// The widest instruction set that this build and this processor have, up to the one that is named: "baseline", "avx2",
/// "avx512"; any other word: without a limit.
InstructionSet widestInstructionSet(const std::string& limit);

/// Not to be touched but by setInstructionSet.
extern InstructionSet instructionSetInUse;

/// What the loops use: when the library is loaded the widest, up to what the environment variable MRF_SIMD names. The
/// results are the same bytes with each.
inline InstructionSet instructionSet()
{
  return instructionSetInUse;
}

/// For tests, which compare them: not while a reconstruction runs. \pre the processor has it
void setInstructionSet(InstructionSet set);

} // namespace pcl::mrf

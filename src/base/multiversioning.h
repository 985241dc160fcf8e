// SPDX-License-Identifier: BSD-3-Clause
/// Hot loops compiled for several instruction sets, and the choice between them.
#pragma once

#include <string>

/// Other processors and compilers, and builds with sanitizers, compile the plain loops only.
#if !defined(MRF_NO_MULTIVERSIONING) && defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define MRF_HAS_MULTIVERSIONING
#endif

namespace pcl::mrf {

/// The instruction sets that the loops are compiled for; each includes the ones before it.
enum class InstructionSet { baseline, avx2, avx512 };

/// The widest instruction set that this build and this processor support, limited to the named one: "baseline", "avx2",
/// "avx512"; any other word is no limit.
InstructionSet widestInstructionSet(const std::string& limit);

/// The instruction set of the loops: when the library is loaded, the widest one within the limit of the environment
/// variable MRF_SIMD. The results are the same bytes with each set. Only tests change it, to compare the results.
extern InstructionSet instructionSet;

} // namespace pcl::mrf

/// For the function bodies that all versions share; the second macro is for lambdas.
#if defined(__GNUC__)
#define MRF_ALWAYS_INLINED __attribute__((always_inline))
#else
#define MRF_ALWAYS_INLINED
#endif
#define MRF_ALWAYS_INLINE inline MRF_ALWAYS_INLINED

/// Defines a function that runs the version for the current instruction set; its body follows:
///   MRF_MULTIVERSION(void, scale, (int count, float a, float* x), (count, a, x))
///   {
///     ...
///   }
/// The arithmetic is the same in all versions: the build switches contraction off, and no loop is reassociated.
#if defined(MRF_HAS_MULTIVERSIONING)
#define MRF_MULTIVERSION(Result, name, parameters, arguments)                                                          \
  static MRF_ALWAYS_INLINE Result name##Baseline parameters;                                                           \
  __attribute__((target("avx512f,prefer-vector-width=512"))) static Result name##Avx512 parameters                     \
  {                                                                                                                    \
    return name##Baseline arguments;                                                                                   \
  }                                                                                                                    \
  __attribute__((target("avx2"))) static Result name##Avx2 parameters                                                  \
  {                                                                                                                    \
    return name##Baseline arguments;                                                                                   \
  }                                                                                                                    \
  Result name parameters                                                                                               \
  {                                                                                                                    \
    switch (instructionSet) {                                                                                          \
    case InstructionSet::avx512:                                                                                       \
      return name##Avx512 arguments;                                                                                   \
    case InstructionSet::avx2:                                                                                         \
      return name##Avx2 arguments;                                                                                     \
    default:                                                                                                           \
      return name##Baseline arguments;                                                                                 \
    }                                                                                                                  \
  }                                                                                                                    \
  static MRF_ALWAYS_INLINE Result name##Baseline parameters
#else
#define MRF_MULTIVERSION(Result, name, parameters, arguments) Result name parameters
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// The hot loops for several instruction sets, and which of them is used.
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

/// What the loops use: when the library is loaded the widest, up to what the environment variable MRF_SIMD names. The
/// results are the same bytes with each. Only tests, which compare them, set it.
extern InstructionSet instructionSet;

} // namespace pcl::mrf

/// For the bodies that the versions of a function share; the second one for lambdas.
#if defined(__GNUC__)
#define MRF_ALWAYS_INLINED __attribute__((always_inline))
#else
#define MRF_ALWAYS_INLINED
#endif
#define MRF_ALWAYS_INLINE inline MRF_ALWAYS_INLINED

/// Defines a function that runs the version for the instruction set in use; its body follows:
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

/// \file
/// \brief Function multi-versioning for the hot loops.
#pragma once

/// Compiles a function for several instruction sets; the best one is chosen when the library is loaded. The arithmetic
/// is the same on all of them: the build switches contraction off, and no loop is reassociated.
#if defined(MRF_NO_MULTIVERSIONING) || !defined(__x86_64__) || !defined(__GNUC__) || defined(__clang__)
#define MRF_MULTIVERSION
#else
#define MRF_HAS_MULTIVERSIONING
#define MRF_MULTIVERSION __attribute__((target_clones("avx512f", "avx2", "default")))
#endif

/// For the bodies that multi-versioned functions share.
#if defined(__GNUC__)
#define MRF_ALWAYS_INLINE inline __attribute__((always_inline))
#else
#define MRF_ALWAYS_INLINE inline
#endif

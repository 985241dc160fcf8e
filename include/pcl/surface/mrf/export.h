// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The visibility of symbols in the shared library.
#pragma once

/// Marks what users of the library may call; the rest is compiled with -fvisibility=hidden.
#if defined(__GNUC__)
#define PCL_MRF_EXPORT __attribute__((visibility("default")))
#else
#define PCL_MRF_EXPORT
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What the shared library shows.
#pragma once

/// Marks what users of the library may call. All else is hidden: it is compiled with -fvisibility=hidden.
#if defined(__GNUC__)
#define PCL_MRF_EXPORT __attribute__((visibility("default")))
#else
#define PCL_MRF_EXPORT
#endif

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief A program that has PCL's templates compiled for its own point type, as PCL_NO_PRECOMPILE asks for.
#pragma once

#include <cstdint>

namespace precompiled_nowhere {

/// Components of the reconstruction of a sphere of points of another type.
std::int64_t componentsOfASphere();

} // namespace precompiled_nowhere

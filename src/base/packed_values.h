// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Arrays of one value per voxel of a band, not set when they are made.
#pragma once

#include "base/uninitialized.h"

#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

using PackedValues = std::vector<float, UninitializedAllocator<float>>;
using PackedFlags = std::vector<std::uint8_t, UninitializedAllocator<std::uint8_t>>;

} // namespace mrf
} // namespace pcl

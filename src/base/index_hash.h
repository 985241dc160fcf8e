// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief One index in so many, scattered: without a generator's state, for any order of asking.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pcl {
namespace mrf {

/// Knuth's multiplicative hash, 0..65535.
inline std::uint32_t indexHash(std::size_t index)
{
  return static_cast<std::uint32_t>(index) * 2654435761u >> 16;
}

} // namespace mrf
} // namespace pcl

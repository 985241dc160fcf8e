// SPDX-License-Identifier: BSD-3-Clause
/// Random numbers by index, independent of the order in which they are drawn.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace pcl::mrf {

/// A hash of an index, 0..65535, to pick every n-th index at random: Knuth's multiplicative hash.
inline std::uint32_t indexHash(std::size_t index)
{
  return static_cast<std::uint32_t>(index) * 2654435761u >> 16;
}

/// Independent standard normal numbers, each a function of seed, draw, kind and index only. SplitMix64 (Steele, Lea,
/// Flood 2014) is the hash, followed by Box and Muller's transformation.
class NormalDraws {
public:
  /// The objects that the indices count; each kind has its own numbers.
  enum class Kind : std::uint64_t { samples, voxels, edges };

  /// \param seed, draw any values; each pair gives another set of numbers
  NormalDraws(std::uint64_t seed, std::uint64_t draw) : key_(mixed(mixed(seed + step) + draw + step)) {}

  /// Two numbers.
  std::array<float, 2> pair(Kind kind, std::uint64_t index) const
  {
    const std::uint64_t bits = mixed(mixed(key_ + static_cast<std::uint64_t>(kind) + 1) + step * (index + 1));
    constexpr double unit = 0x1p-32, half = 0x1p-33; // keeps the logarithm's argument above 0
    const double radius = std::sqrt(-2 * std::log(static_cast<double>(bits >> 32) * unit + half)),
                 angle = 2 * M_PI * unit * static_cast<double>(bits & 0xffffffffu);
    return {static_cast<float>(radius * std::cos(angle)), static_cast<float>(radius * std::sin(angle))};
  }

private:
  static constexpr std::uint64_t step = 0x9e3779b97f4a7c15u;

  static std::uint64_t mixed(std::uint64_t bits)
  {
    bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ bits >> 27) * 0x94d049bb133111ebu;
    return bits ^ bits >> 31;
  }

  std::uint64_t key_;
};

} // namespace pcl::mrf

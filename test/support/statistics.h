/// \file
/// \brief Sums up measured values.
#pragma once

#include <cmath>
#include <vector>

namespace statistics {

/// Root mean square.
inline double rms(const std::vector<double>& values)
{
  double sum = 0;
  for (const double value : values)
    sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

} // namespace statistics

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Sums up measured values.
#pragma once

#include <cmath>
#include <vector>

/// Root of the mean of the squares; 0 for no values.
inline double rootMeanSquare(const std::vector<double>& values)
{
  double sum = 0;
  for (const double value : values)
    sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

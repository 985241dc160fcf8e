// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Plots as SVG.
#pragma once

#include "experiment.h"

#include <string>
#include <vector>

namespace mrf_apps {

struct Tick {
  double value;
  std::string label; ///< empty: a minor one
};

/// Round numbers that cover a range: about `count` of them, or the powers of ten with 2 and 5 where there is room.
/// \pre lower < upper, both positive if isLog
std::vector<Tick> ticks(double lower, double upper, bool isLog, int count);

/// Axes with ticks, curves with marks or bars, a legend if there is more than one curve. Values that are not finite,
/// or not positive on a logarithmic axis, are left out.
std::string toSvg(const Plot& plot);

} // namespace mrf_apps

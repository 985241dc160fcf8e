// SPDX-License-Identifier: BSD-3-Clause
/// Laws of the scanner's noise that users give by name and numbers.
#pragma once

#include <pcl/surface/mrf/options.h>

#include <optional>
#include <string>

namespace pcl::mrf {

/// σ at a range z from the sensor: constant + linear z + quadratic z².
struct NoiseLaw {
  double constant = 0;  ///< cloud's unit
  double linear = 0;    ///< ratio
  double quadratic = 0; ///< per cloud's unit

  bool isByRange() const { return linear > 0 || quadratic > 0; }
  double deviation(double range) const { return constant + range * (linear + range * quadratic); }
};

/// The law that ObservationOptions::noiseModel names; none for "automatic" and "none".
/// \throw InvalidOption if there is no such law, it has too few or too many numbers, or σ is 0
std::optional<NoiseLaw> noiseLaw(const std::string& model);

/// The known σ of all points: ObservationOptions::noise, or the S of "constant:S"; 0 = unknown.
double constantNoise(const ObservationOptions& options);

} // namespace pcl::mrf

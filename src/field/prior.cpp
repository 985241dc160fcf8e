// SPDX-License-Identifier: BSD-3-Clause
#include "field/prior.h"

#include <cmath>

namespace pcl::mrf {

double smoothingLength(const PriorOptions& options, double voxelSize)
{
  int power = order(options.kind);
  double coefficient = centerCoefficient(options.kind);
  if (options.energy == Energy::paper) {
    coefficient = power == 1 ? 3 : 18;
    power = power == 1 ? 1 : 3;
  }
  const double beta = options.beta;
  return voxelSize * std::pow(coefficient * beta / (1 - beta), -.5 / power);
}

} // namespace pcl::mrf

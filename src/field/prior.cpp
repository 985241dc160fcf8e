// SPDX-License-Identifier: BSD-3-Clause
#include "field/prior.h"

#include <cmath>

namespace pcl {
namespace mrf {

double dataCoefficient(const PriorOptions& options)
{
  if (options.energy != Energy::paperText || options.kind == Prior::membrane)
    return centerCoefficient(options.kind);
  return options.kind == Prior::thinPlate ? 36. / 7 : 18;
}

double smoothingLength(const PriorOptions& options, double voxelSize)
{
  const double beta = options.beta;
  const double balance = dataCoefficient(options) * beta / (1 - beta);
  return voxelSize * std::pow(balance, -.5 / order(options.kind));
}

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/prior.h>

#include <pcl/surface/mrf/exceptions.h>

#include <cmath>
#include <string>

namespace pcl {
namespace mrf {

void validate(const PriorOptions& options)
{
  const int k = order(options.prior);
  if (k < 1 || k > 3)
    throw InvalidOption("prior is of order " + std::to_string(k) + "; it must be 1, 2 or 3");
  if (!(options.beta >= 0 && options.beta < 1))
    throw InvalidOption("beta is " + std::to_string(options.beta) + "; it must be at least 0 and below 1");
  if (options.energy != Energy::joint && options.energy != Energy::weighted && options.energy != Energy::paperText)
    throw InvalidOption("energy is " + std::to_string(static_cast<int>(options.energy)) +
                        "; it must be joint, weighted or paperText");
}

double dataCoefficient(const PriorOptions& options)
{
  if (options.energy != Energy::paperText || options.prior == Prior::membrane)
    return centerCoefficient(options.prior);
  return options.prior == Prior::thinPlate ? 36. / 7 : 18;
}

double smoothingLength(const PriorOptions& options, double voxelSize)
{
  const double beta = options.beta;
  const double balance = dataCoefficient(options) * beta / (1 - beta);
  return voxelSize * std::pow(balance, -.5 / order(options.prior));
}

} // namespace mrf
} // namespace pcl

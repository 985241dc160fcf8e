// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Intervals of what is known from few samples.
#pragma once

#include <boost/math/distributions/students_t.hpp>

namespace pcl {
namespace mrf {

/// Half of the width of an interval of 95 %, in standard deviations: 1.96 for many degrees of freedom.
/// \param freedom degrees of it, > 0
inline double studentHalfWidth(double freedom)
{
  constexpr double above = .975;
  return boost::math::quantile(boost::math::students_t(freedom), above);
}

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
#include "portable_math.h"

namespace portable {

SinCos sinCos(double turns)
{
  const double quarter = std::floor(4 * turns + .5);
  const double x = (turns - .25 * quarter) * 6.283185307179586476925; // in [-π/4, π/4]
  const double xx = x * x;
  // Taylor series in nested form; the first term left out is below 1e-17 at π/4.
  double sine = 1, cosine = 1;
  for (int n = 18; n >= 2; n -= 2) {
    cosine = 1 - xx / (n * (n - 1)) * cosine;
    sine = 1 - xx / (n * (n + 1)) * sine;
  }
  sine *= x;
  switch (static_cast<int>(quarter - 4 * std::floor(.25 * quarter))) {
  case 0:
    return {sine, cosine};
  case 1:
    return {cosine, -sine};
  case 2:
    return {-sine, -cosine};
  default:
    return {-cosine, sine};
  }
}

double logarithm(double x)
{
  int exponent = 0;
  double mantissa = std::frexp(x, &exponent); // in [.5, 1)
  if (mantissa < .70710678118654752) {
    mantissa *= 2;
    --exponent;
  }
  // log m = 2 artanh s; |s| ≤ .172, so eleven terms leave less than 1e-17.
  const double s = (mantissa - 1) / (mantissa + 1);
  double sum = 0;
  for (int n = 21; n >= 1; n -= 2)
    sum = 1.0 / n + s * s * sum;
  return 2 * s * sum + exponent * .693147180559945309417;
}

} // namespace portable

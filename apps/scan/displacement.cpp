// SPDX-License-Identifier: BSD-3-Clause
#include "displacement.h"

#include <shapes/portable_math.h>

namespace pcl {
namespace mrf {
namespace scan {

using Eigen::Vector3d;

Displacement::Displacement(double amplitude, double wavelength, Random& random)
{
  const int count = 24; // enough that the heights are close to Gaussian
  for (int i = 0; i < count; ++i) {
    const Vector3d direction = random.direction();
    waves_.push_back({direction / wavelength, random.uniform()});
  }
  scale_ = amplitude * std::sqrt(2.0 / count);
}

double Displacement::height(const Vector3d& position, Vector3d& gradient) const
{
  double sum = 0;
  gradient.setZero();
  for (const Wave& wave : waves_) {
    const portable::SinCos value = portable::sinCos(portable::dot(wave.perLength, position) + wave.phase);
    sum += value.sine;
    gradient += value.cosine * wave.perLength;
  }
  gradient *= scale_ * 6.283185307179586476925;
  return scale_ * sum;
}

bool Displacement::apply(SurfacePoint& point) const
{
  Vector3d gradient;
  const double h = height(point.position, gradient);
  const Vector3d direction = point.displacementDirection;
  Vector3d tangents[2];
  for (int i = 0; i < 2; ++i)
    tangents[i] =
        point.tangents[i] + portable::dot(gradient, point.tangents[i]) * direction + h * point.normalChanges[i];
  const Vector3d normal = portable::unit(portable::cross(tangents[0], tangents[1]));
  // Upside down: the height exceeds the radius of curvature.
  if (!(portable::dot(normal, point.normal) > 0))
    return false;
  point.position += h * direction;
  point.normal = normal;
  return true;
}

} // namespace scan
} // namespace mrf
} // namespace pcl

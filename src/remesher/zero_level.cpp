// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/zero_level.h"

#include "field/field_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace pcl::mrf {
namespace {

using Eigen::Vector3f;

/// |d| / |∇d| in voxels up to which a position counts as on the zero level.
constexpr float onLevel = 1e-3f;
/// |d| / |∇d| in voxels up to which a straight step is as good as a Runge–Kutta step: the gradient hardly turns on the
/// way, and the next step removes the rest of the distance.
constexpr float straightStep = .25f;
/// A few steps may be needed, as the gradient is of a smoother interpolation than the distance. If more are, they do
/// not converge.
constexpr int maxSteps = 8;

} // namespace

Vector3f ZeroLevel::normalAt(const Vector3f& position, const Vector3f& fallback) const
{
  const Vector3f gradient = field_.sampleGradient(position);
  const float norm = gradient.norm();
  return norm > 1e-6f ? Vector3f(gradient / norm) : fallback;
}

std::optional<Corner> ZeroLevel::trace(const Vector3f& start) const
{
  const auto slopeOf = [](const Vector3f& gradient) -> Vector3f { return gradient / gradient.squaredNorm(); };
  FieldSampler field(field_);
  const auto slopeAt = [&](const Vector3f& at) {
    Vector3f gradient;
    field.sampleDistance(at, gradient);
    return slopeOf(gradient);
  };
  // True if the steps will not arrive in time. Each step leaves about the same share of the distance: between close
  // sheets the distance is twice as steep as its smoothed gradient, so that steps go to and fro. In a cluttered room
  // two in three reads of the field were for such steps. As shares change a little, the smaller one of the last two
  // counts, and the distance that it leaves must be over twice the one of a position on the level.
  float formerDistance = 0, formerShare = 0;
  float farthest = std::numeric_limits<float>::infinity();
  const auto isHopeless = [&](float distance, int steps) {
    const float share = formerDistance > 0 ? distance / formerDistance : 0;
    const float smaller = std::min(std::exchange(formerShare, share), share);
    formerDistance = distance;
    return distance * std::pow(smaller, static_cast<float>(steps)) > 2 * onLevel;
  };
  Vector3f x = start;
  // Each step integrates dx/dd = ∇d/|∇d|² from d to 0.
  for (int step = 0; step < maxSteps && (x - start).squaredNorm() <= farthest * farthest; ++step) {
    Vector3f gradient;
    const float d = field.sampleDistance(x, gradient);
    const float spacing = field.spacing();
    if (step == 0)
      farthest = maxVoxels_ * spacing;
    const Vector3f k1 = slopeOf(gradient);
    if (!k1.allFinite())
      break;
    const float distance = std::abs(d) * k1.norm();
    if (distance <= onLevel * spacing)
      return Corner{x, gradient.normalized()};
    if (isHopeless(distance / spacing, maxSteps - 1 - step))
      break;
    if (distance <= straightStep * spacing) {
      x -= d * k1;
    } else {
      const Vector3f k2 = slopeAt(x - .5f * d * k1);
      const Vector3f k3 = slopeAt(x - .5f * d * k2);
      const Vector3f k4 = slopeAt(x - d * k3);
      x -= d / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
  }
  return {};
}

float ZeroLevel::height(const Vector3f& position) const
{
  FieldSampler field(field_);
  Vector3f gradient;
  const float d = field.sampleDistance(position, gradient);
  const float height = d / gradient.norm();
  return std::abs(height) <= maxVoxels_ * field.spacing() ? height : 0; // 0 as well for NaN, if the gradient vanishes
}

} // namespace pcl::mrf

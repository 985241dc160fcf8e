/// \file
/// \brief The prior operator applied plane by plane with all of its powers kept in cache.
#pragma once

#include "plane_kernels.h"

#include <pcl/surface/mrf/prior.h>

#include <algorithm>
#include <array>
#include <vector>

namespace pcl {
namespace mrf {

/// Produces the planes of P x in ascending order, one sweep over x for all powers of L.
///
///     x        . . z z+1 z+2 z+3
///     L x      . . z z+1 z+2        the last three planes of each power are kept
///     L² x     . . z z+1
///     L³ x     . . z                handed to the caller
///
/// The values do not depend on where a sweep starts, so a grid can be cut into slabs anywhere.
template <typename Real>
class PriorPipeline {
public:
  explicit PriorPipeline(const PriorOperator<Real>& prior)
      : prior_(&prior), plane_(static_cast<std::size_t>(prior.size.planeCount())), order_(order(prior.prior)),
        kept_(3 * plane_ * static_cast<std::size_t>(order_ - 1))
  {}

  /// The next plane to be produced is `first`.
  void restart(int first)
  {
    for (int power = 1; power <= order_; ++power)
      next_[static_cast<std::size_t>(power)] = std::max(0, first - (order_ - power));
  }

  /// Plane z of P x. \param planeOf gives the address of a plane of x; those up to z + k are read
  template <typename PlaneOf>
  void produce(int z, const PlaneOf& planeOf, Real* out)
  {
    advance(order_, z, planeOf, out);
  }

  std::size_t bytes() const { return kept_.size() * sizeof(Real); }

private:
  template <typename PlaneOf>
  void advance(int power, int z, const PlaneOf& planeOf, Real* out)
  {
    const int last = prior_->size.z - 1;
    int& next = next_[static_cast<std::size_t>(power)];
    for (; next <= z; ++next) {
      if (power > 1)
        advance(power - 1, std::min(next + 1, last), planeOf, out);
      const auto lower = [&](int plane) -> const Real* { return power > 1 ? kept(power - 1, plane) : planeOf(plane); };
      const int below = std::max(next - 1, 0), above = std::min(next + 1, last);
      Real* target = power == order_ ? out : kept(power, next);
      differentiate(power, below, next, above, lower(below), lower(next), lower(above), target);
    }
  }

  void differentiate(int power, int zBelow, int z, int zAbove, const Real* below, const Real* centre, const Real* above,
                     Real* out) const
  {
    const GridSize& size = prior_->size;
    if (prior_->voxelWeights.empty()) {
      kernels::laplacian(size.x, size.y, below, centre, above, out);
      return;
    }
    const auto weights = [&](int plane) {
      return prior_->voxelWeights.data() + plane_ * static_cast<std::size_t>(plane);
    };
    if (order_ != 2 && power == (order_ + 1) / 2) { // L_v in the middle of L_v and L L_v L
      kernels::weightedLaplacian(size.x, size.y, below, centre, above, weights(zBelow), weights(z), weights(zAbove),
                                 out);
      return;
    }
    kernels::laplacian(size.x, size.y, below, centre, above, out);
    if (order_ == 2 && power == 1)
      kernels::multiply(size.planeCount(), weights(z), out);
  }

  Real* kept(int power, int z)
  {
    return kept_.data() + (static_cast<std::size_t>(power - 1) * 3 + static_cast<std::size_t>(z % 3)) * plane_;
  }

  const PriorOperator<Real>* prior_;
  std::size_t plane_;
  int order_;
  std::vector<Real> kept_;
  std::array<int, 4> next_{};
};

} // namespace mrf
} // namespace pcl

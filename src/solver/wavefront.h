// SPDX-License-Identifier: BSD-3-Clause
/// The order in which a sweep that takes several steps at once visits the planes of a slab.
#pragma once

#include <algorithm>

namespace pcl::mrf {

/// Each step of a smoother needs products with L^k, which reach k planes to either side. In a wavefront step s follows
/// a few planes behind step s − 1, so that all of them are taken while the planes are in the cache:
///
///     x of step s − 1   . . . . . z+1 z+2 z+3
///     L x               . . . . . z+1 z+2          k = 3: the powers of L are computed as far ahead as the planes of
///     L² x              . . . . . z+1              the step before allow
///     product, x of s   . . . . z
///
/// Planes without voxels are left out, but for one on either side, so that the rings hold zeros there.
///
/// The iterate is updated in place. Steps trail each other by k planes, for k = 1 by two, as an update would overtake
/// the next plane's product. A slab computes k planes of its neighbors for each step again.
class Wavefront {
public:
  /// \param steps number of updates of the iterate \param endsWithProduct a product with the last iterate follows them
  /// \param begin, end planes of the slab \param bottom, top planes [bottom, top) hold all voxels
  Wavefront(int order, int steps, bool endsWithProduct, int begin, int end, int bottom, int top)
      : order_(order), delay_(order == 1 ? 1 : 0), steps_(steps), products_(steps + (endsWithProduct ? 1 : 0)),
        begin_(begin), end_(end), bottom_(bottom), top_(top)
  {}

  int products() const { return products_; }

  /// Planes [low(s), high(s)) of product s are computed, and of the iterate known after step s; s = 0 is the start.
  int low(int step) const { return std::max(begin_ - order_ * (products_ - step), bottom_ - 1); }
  int high(int step) const { return std::min(end_ + order_ * (products_ - step), top_ + 1); }

  /// Consecutive planes that a ring has to hold: of the iterate, of each power of L, of each product.
  int iteratePlanes() const { return products_ * lag() + order_ + 3; }
  int powerPlanes() const { return 3; }
  int productPlanes() const { return 2 + delay_; }

  /// Calls the following members of a pass, each when its input is there and before that is overwritten:
  ///   start(z): sets plane z of the iterate at the start
  ///   differentiate(step, power, z): L^power, 0 < power < k, of the iterate after step − 1, from planes z − 1 to z + 1
  ///   addData(step, z): adds the data of the layer between planes z and z + 1 to both planes of the product
  ///   addPrior(step, z): adds the prior, which completes plane z of the product
  ///   update(step, z): takes the step on plane z; the product that ends the sweep has finish(z) in its place
  template <typename Pass>
  void run(Pass& pass) const
  {
    const int last = high(0) + products_ * lag() + order_;
    for (int t = low(0); t < last; ++t) {
      if (t < high(0))
        pass.start(t);
      for (int step = 1; step <= products_; ++step)
        advance(pass, step, t - step * lag());
    }
  }

private:
  int lag() const { return order_ + delay_; }

  template <typename Pass>
  void advance(Pass& pass, int step, int z) const
  {
    // Lower powers are ahead: a plane of a power needs the next plane of the power below.
    for (int power = 1; power < order_; ++power) {
      const int ahead = order_ - power, at = z + ahead;
      if (at >= std::max(low(step) - ahead, bottom_ - 1) && at < std::min(high(step) + ahead, top_ + 1))
        pass.differentiate(step, power, at);
    }
    const bool isProduct = z >= low(step) && z < high(step);
    if (isProduct || z == low(step) - 1)
      pass.addData(step, z);
    if (isProduct)
      pass.addPrior(step, z);
    if (step > steps_) {
      if (isProduct)
        pass.finish(z);
    } else if (z - delay_ >= low(step) && z - delay_ < high(step)) {
      pass.update(step, z - delay_);
    }
  }

  int order_, delay_, steps_, products_, begin_, end_, bottom_, top_;
};

} // namespace pcl::mrf

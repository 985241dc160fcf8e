// SPDX-License-Identifier: BSD-3-Clause
#include "solver/wavefront.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

using pcl::mrf::Wavefront;

namespace {

/// Follows a sweep and checks that each action finds its inputs: the iterate after the right number of steps, powers of
/// L and products that are complete, and nothing that the ring no longer holds. Planes two or more away from those with
/// voxels are not visited, and their values do not matter.
class Recorder {
public:
  Recorder(const Wavefront& wavefront, int order, int steps, int bottom, int top)
      : wavefront_(wavefront), order_(order), steps_(steps), bottom_(bottom), top_(top)
  {}

  void start(int z)
  {
    expectVisited(z);
    EXPECT_EQ(z, started_ == none ? wavefront_.low(0) : started_ + 1);
    started_ = z;
    iterate_[z] = 0;
  }

  void differentiate(int step, int power, int z)
  {
    expectVisited(z);
    for (int plane = z - 1; plane <= z + 1; ++plane)
      expectPower(step, power - 1, plane);
    powers_[{step, power}] = z;
    lowestPower_.try_emplace({step, power}, z);
  }

  void addData(int step, int z)
  {
    // The planes z and z + 1 as the step before has left them; at the slab's border the first layer reaches out of it.
    if (z >= wavefront_.low(step))
      expectIterate(step - 1, z);
    if (z + 1 < wavefront_.high(step))
      expectIterate(step - 1, z + 1);
    EXPECT_EQ(z, data_.count(step) ? data_[step] + 1 : wavefront_.low(step) - 1);
    data_[step] = z;
  }

  void addPrior(int step, int z)
  {
    for (int plane = z - 1; plane <= z + 1; ++plane)
      expectPower(step, order_ - 1, plane);
    EXPECT_EQ(data_[step], z) << "the layers below and above the plane";
    products_[step] = z;
  }

  void update(int step, int z)
  {
    EXPECT_LE(step, steps_);
    EXPECT_GE(products_.at(step), z);
    EXPECT_LT(products_.at(step) - z, wavefront_.productPlanes()) << "its product is still there";
    expectIterate(step - 1, z);
    iterate_[z] = step;
    updated_[step].push_back(z);
  }

  void finish(int z)
  {
    EXPECT_EQ(products_.at(wavefront_.products()), z);
    finished_.push_back(z);
  }

  const std::vector<int>& updated(int step) { return updated_[step]; }
  const std::vector<int>& finished() const { return finished_; }

private:
  static constexpr int none = -1000000;

  bool mayBeVisited(int z) const { return z >= bottom_ - 1 && z <= top_; }
  void expectVisited(int z) const { EXPECT_TRUE(mayBeVisited(z)) << "plane " << z; }

  void expectIterate(int step, int z)
  {
    if (!mayBeVisited(z))
      return;
    ASSERT_TRUE(iterate_.count(z)) << "plane " << z;
    EXPECT_EQ(iterate_[z], step) << "plane " << z;
    EXPECT_LT(started_ - z, wavefront_.iteratePlanes()) << "plane " << z << " has been overwritten";
  }

  void expectPower(int step, int power, int z)
  {
    if (power == 0) {
      expectIterate(step - 1, z);
      return;
    }
    if (!mayBeVisited(z))
      return;
    const int last = powers_.at({step, power});
    EXPECT_LE(z, last);
    EXPECT_GT(z, last - wavefront_.powerPlanes());
    EXPECT_GE(z, lowestPower_.at({step, power}));
  }

  const Wavefront& wavefront_;
  int order_, steps_, bottom_, top_, started_ = none;
  std::map<int, int> iterate_, data_, products_;
  std::map<std::pair<int, int>, int> powers_, lowestPower_;
  std::map<int, std::vector<int>> updated_;
  std::vector<int> finished_;
};

std::vector<int> planes(int begin, int end)
{
  std::vector<int> result;
  for (int z = begin; z < end; ++z)
    result.push_back(z);
  return result;
}

} // namespace

TEST(Wavefront, visitsEveryPlaneWhenWhatItNeedsIsThere)
{
  for (const int order : {1, 2, 3, 4})
    for (const int steps : {0, 1, 2, 5, 20})
      for (const bool endsWithProduct : {false, true})
        for (const auto& [begin, end] : {std::pair<int, int>{0, 40}, {7, 12}, {3, 4}})
          for (const auto& [bottom, top] : {std::pair<int, int>{-1000, 1000}, {4, 36}, {9, 10}, {3, 11}}) {
            SCOPED_TRACE(testing::Message()
                         << "k = " << order << ", " << steps << " steps, planes " << begin << " to " << end << " of "
                         << bottom << " to " << top << (endsWithProduct ? ", product" : ""));
            const Wavefront wavefront(order, steps, endsWithProduct, begin, end, bottom, top);
            Recorder recorder(wavefront, order, steps, bottom, top);
            wavefront.run(recorder);
            for (int step = 1; step <= steps; ++step)
              EXPECT_EQ(recorder.updated(step), planes(wavefront.low(step), wavefront.high(step)));
            const int first = std::max(begin, bottom - 1), last = std::min(end, top + 1);
            EXPECT_EQ(recorder.finished(), endsWithProduct ? planes(first, last) : std::vector<int>());
            EXPECT_LE(wavefront.low(steps), first);
            EXPECT_GE(wavefront.high(steps), last);
          }
}

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Clouds of every kind, good and bad, and valid options of every kind, drawn by a seed.
#pragma once

#include <pcl/surface/mrf/options.h>

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace random_clouds {

/// Numbers that are the same with every standard library.
class Random {
public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// In [0, count). The bias of the remainder does not matter here.
  std::size_t index(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }
  bool oneIn(std::size_t count) { return index(count) == 0; }
  double uniform(double lower, double upper);
  /// 10 to a power that is uniform.
  double decades(double lowerPower, double upperPower);
  /// In [-1, 1]³.
  Eigen::Vector3d inCube();
  /// Uniform on the unit sphere.
  Eigen::Vector3d direction();

private:
  std::mt19937_64 engine_;
};

/// What a user hands to the class.
struct Cloud {
  std::string kind;
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3d> normals; ///< as many, or none
  std::vector<float> confidences;       ///< as many, or none
  std::vector<Eigen::Vector3d> sensors;
  std::vector<std::int32_t> views; ///< one per point, or none
  bool hasColors = false;
};

/// What draws the clouds of one kind.
struct Kind {
  const char* name;
  Cloud (*make)(Random&);
};

const std::vector<Kind>& kinds();

/// A cloud of the kind, some with sensors, colors, confidences, repeated points, or without normals.
Cloud drawCloud(const Kind& kind, Random& random);

/// Options that are valid for the lengths of the cloud, mostly near the defaults, now and then at the ends of what is
/// allowed. \param description appended: what differs from the defaults
pcl::mrf::Options drawOptions(const Cloud& cloud, Random& random, std::string& description);

} // namespace random_clouds

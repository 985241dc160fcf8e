// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief How far the zero level of one field is from that of another.
#pragma once

#include "mesh/polygonizer.h"

#include <algorithm>
#include <cmath>
#include <vector>

/// First-order distances of the vertices of a field's zero level from that of another field, in voxel sides.
inline std::vector<double> zeroLevelOffsets(const pcl::mrf::DistanceField& field, const pcl::mrf::DistanceField& other)
{
  pcl::mrf::Execution execution(1);
  std::vector<double> result;
  for (const Eigen::Vector3f& vertex : pcl::mrf::polygonize(field, execution).vertices)
    result.push_back(std::abs(other.sampleDistance(vertex)) / std::max(other.sampleGradient(vertex).norm(), .3f) /
                     field.lattice().spacing);
  return result;
}

/// \file
/// \brief Nearest-neighbour queries on plain positions; PCL's search objects stand behind it.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <memory>
#include <vector>

namespace pcl {
namespace mrf {

/// The answer to one query: indices into the positions, and squared distances, nearest first.
struct Neighbours {
  std::vector<int> indices;
  std::vector<float> squaredDistances;
};

/// A set of positions that answers nearest-neighbour queries. Queries may run concurrently, each with its own result.
class NeighbourSearch {
public:
  virtual ~NeighbourSearch() = default;

  /// Replaces the positions that are searched (copied as far as the implementation needs them).
  virtual void setPoints(const std::vector<Eigen::Vector3f>& positions) = 0;

  /// The k nearest positions (fewer if there are fewer), nearest first; the point itself is among them if it is a
  /// position. \return how many were found
  virtual int nearest(const Eigen::Vector3f& query, int k, Neighbours& result) const = 0;

  /// All positions within `radius`, nearest first. \return how many were found
  virtual int within(const Eigen::Vector3f& query, float radius, Neighbours& result) const = 0;
};

/// The default: pcl::KdTreeFLANN with exact queries.
std::unique_ptr<NeighbourSearch> makeKdTree();

} // namespace mrf
} // namespace pcl

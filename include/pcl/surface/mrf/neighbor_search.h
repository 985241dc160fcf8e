// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Nearest-neighbor queries on plain positions.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/options.h>

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace pcl::mrf {

/// The answer to one query: indices of positions and squared distances, nearest first, equal distances by index.
struct Neighbors {
  std::vector<int> indices;
  std::vector<float> squaredDistances;
};

/// The answers for some of the searched positions: the `k` neighbors of each, the position itself included, as
/// NeighborSearch::nearest finds them. If there are fewer than k, the rest has infinite distances.
struct NeighborBatch {
  std::size_t size = 0;                     ///< positions answered for
  std::size_t k = 0;                        ///< neighbors of each
  const std::uint32_t* positions = nullptr; ///< `size` indices
  const float* squaredDistances = nullptr;  ///< those of position n start at n·k, ascending
  const std::uint32_t* indices = nullptr;   ///< likewise; null if only distances were asked for
};

/// A set of positions that answers nearest-neighbor queries. Queries may run concurrently, each with its own result.
class PCL_MRF_EXPORT NeighborSearch {
public:
  virtual ~NeighborSearch() = default;

  /// Replaces the positions that are searched (copied as far as the implementation needs them).
  virtual void setPoints(const std::vector<Eigen::Vector3f>& positions) = 0;

  /// The same on the threads of `execution`, where the implementation can use them.
  virtual void setPoints(const std::vector<Eigen::Vector3f>& positions, Execution& execution);

  /// Drops the positions whose flag is not set; those that are left are numbered anew, in their order.
  /// \param left those positions \param keep one flag per position that was searched so far
  virtual void dropPoints(const std::vector<Eigen::Vector3f>& left, const std::vector<std::uint8_t>& keep,
                          Execution& execution);

  /// Frees what memory it can. No query is allowed until wake.
  virtual void rest() {}
  /// Makes queries possible again. \param positions those that were searched before rest
  virtual void wake(const std::vector<Eigen::Vector3f>& /*positions*/, Execution& /*execution*/) {}

  /// The k nearest positions (all if there are fewer), nearest first. A query that is one of the positions is included.
  /// The implementation decides which of several positions at the k-th distance are found.
  /// \return how many were found
  virtual int nearest(const Eigen::Vector3f& query, int k, Neighbors& result) const = 0;

  /// All positions closer than `radius`, nearest first. \return how many were found
  virtual int within(const Eigen::Vector3f& query, float radius, Neighbors& result) const = 0;

  /// What the answers of forEachPosition hold.
  enum class Answer { distances, indicesAndDistances };

  /// Finds the k nearest of every position, each once. The implementation chooses the order and the batches. This is
  /// much cheaper than single queries. `visit` is called concurrently.
  /// \param positions those that setPoints was given
  virtual void forEachPosition(const std::vector<Eigen::Vector3f>& positions, int k, Answer answer,
                               Execution& execution, const std::function<void(const NeighborBatch&)>& visit) const;
};

/// The default: a tree of boxes over leaves of sixteen points, for any distribution of points. Answers are exact in
/// single precision; of equal distances those with the smaller indices are found. It is built in parallel, and answers
/// do not depend on the number of threads. It takes about 18 bytes per position, 22 while it is built, 4 at rest.
PCL_MRF_EXPORT std::unique_ptr<NeighborSearch> makePointBins();

/// pcl::search::KdTree (FLANN) with exact queries. It may find any of several positions at the k-th distance.
PCL_MRF_EXPORT std::unique_ptr<NeighborSearch> makeKdTree();

/// The search that Options::search asks for.
PCL_MRF_EXPORT std::unique_ptr<NeighborSearch> makeSearch(SearchKind kind);

} // namespace pcl::mrf

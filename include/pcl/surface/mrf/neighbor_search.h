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

/// The answer to one query: indices into the positions, and squared distances, nearest first, equals by index.
struct Neighbors {
  std::vector<int> indices;
  std::vector<float> squaredDistances;
};

/// The answers for some of the positions themselves: `k` neighbors each, the position itself among them, as
/// NeighborSearch::nearest finds them. Where there are fewer, the rest has an infinite distance.
struct NeighborBatch {
  std::size_t size = 0;                     ///< positions answered for
  std::size_t k = 0;                        ///< neighbors of each
  const std::uint32_t* positions = nullptr; ///< `size` indices
  const float* squaredDistances = nullptr;  ///< those of entry n from n·k on, ascending
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

  /// Gives back what memory it can: nothing is asked until it is woken. Does nothing where there is none to give back.
  virtual void rest() {}
  /// \param positions those that it held when it came to rest
  virtual void wake(const std::vector<Eigen::Vector3f>& /*positions*/, Execution& /*execution*/) {}

  /// The k nearest positions (fewer if there are fewer), nearest first; the point itself is among them if it is a
  /// position. Of equals at the k-th distance, the one with the smaller index where the implementation says so.
  /// \return how many were found
  virtual int nearest(const Eigen::Vector3f& query, int k, Neighbors& result) const = 0;

  /// All positions closer than `radius`, nearest first. \return how many were found
  virtual int within(const Eigen::Vector3f& query, float radius, Neighbors& result) const = 0;

  /// What the answers of forEachPosition hold.
  enum class Answer { distances, indicesAndDistances };

  /// Answers for every position, each once, in an order and in batches of the implementation's choice: much cheaper
  /// than a query at a time. `visit` is called concurrently.
  /// \param positions those that setPoints was given
  virtual void forEachPosition(const std::vector<Eigen::Vector3f>& positions, int k, Answer answer,
                               Execution& execution, const std::function<void(const NeighborBatch&)>& visit) const;
};

/// The default: points in leaves of sixteen, and a tree of boxes over them, whatever their distribution. Exact:
/// distances in single precision, of equals the smaller indices. Built in parallel; same answers for any number of
/// threads. About 18 bytes per position, 22 while it is built, 4 at rest.
PCL_MRF_EXPORT std::unique_ptr<NeighborSearch> makePointBins();

/// pcl::search::KdTree (FLANN) with exact queries; which of equals at the k-th distance it finds is not defined.
PCL_MRF_EXPORT std::unique_ptr<NeighborSearch> makeKdTree();

/// What Options::search asks for.
PCL_MRF_EXPORT std::unique_ptr<NeighborSearch> makeSearch(SearchKind kind);

} // namespace pcl::mrf

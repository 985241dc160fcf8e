// SPDX-License-Identifier: BSD-3-Clause
/// The search of a run, lent to PCL's own algorithms.
#pragma once

#include <pcl/surface/mrf/neighbor_search.h>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/search.h>

#include <atomic>
#include <exception>
#include <vector>

namespace pcl::mrf {

PointCloud<PointXYZ>::Ptr toPclCloud(const std::vector<Eigen::Vector3f>& positions);

/// Answers with the points of a search that outlives it. Exceptions must not leave PCL's parallel loops: the first one
/// waits here, and nothing is found from then on.
class SearchForPcl : public search::Search<PointXYZ> {
public:
  using search::Search<PointXYZ>::nearestKSearch;
  using search::Search<PointXYZ>::radiusSearch;

  explicit SearchForPcl(const NeighborSearch& search) : search::Search<PointXYZ>("SearchForPcl", true), search_(search)
  {}

  int nearestKSearch(const PointXYZ& point, int k, Indices& indices, std::vector<float>& distances) const override;

  /// \param max not used: all neighbors are found
  int radiusSearch(const PointXYZ& point, double radius, Indices& indices, std::vector<float>& distances,
                   unsigned int max) const override;

  /// Throws what was thrown so far.
  void rethrow() const;

private:
  template <typename Query>
  int answer(Indices& indices, std::vector<float>& distances, const Query& query) const;

  const NeighborSearch& search_;
  mutable std::atomic<bool> hasFailed_{false};
  mutable std::exception_ptr error_; ///< of the one that set hasFailed_
};

} // namespace pcl::mrf

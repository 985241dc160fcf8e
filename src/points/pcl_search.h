// SPDX-License-Identifier: BSD-3-Clause
/// Lends the search of a run to PCL's own algorithms.
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

/// Answers PCL's queries by a NeighborSearch, which must outlive it. Exceptions must not leave PCL's parallel loops:
/// the first one is kept for rethrow(), and later queries find nothing.
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

  /// Throws the exception that was kept, if any.
  void rethrow() const;

private:
  template <typename Query>
  int answer(Indices& indices, std::vector<float>& distances, const Query& query) const;

  const NeighborSearch& search_;
  mutable std::atomic<bool> hasFailed_{false};
  mutable std::exception_ptr error_; ///< of the query that set hasFailed_
};

} // namespace pcl::mrf

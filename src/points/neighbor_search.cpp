// SPDX-License-Identifier: BSD-3-Clause
#include "points/pcl_search.h"

#include <pcl/search/kdtree.h>
#include <pcl/surface/mrf/neighbor_search.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace pcl::mrf {
namespace {

/// If memory runs out during a query, FLANN ends the process, because it allocates inside of its own parallel loop.
class KdTree : public NeighborSearch {
public:
  void setPoints(const std::vector<Eigen::Vector3f>& positions) override { tree_.setInputCloud(toPclCloud(positions)); }

  int nearest(const Eigen::Vector3f& query, int k, Neighbors& result) const override
  {
    return orderTies(tree_.nearestKSearch(toPoint(query), k, result.indices, result.squaredDistances), result);
  }

  int within(const Eigen::Vector3f& query, float radius, Neighbors& result) const override
  {
    return orderTies(tree_.radiusSearch(toPoint(query), radius, result.indices, result.squaredDistances), result);
  }

private:
  static int orderTies(int found, Neighbors& result)
  {
    for (std::size_t n = 1; n < static_cast<std::size_t>(found); ++n)
      for (std::size_t m = n; m > 0 && result.squaredDistances[m] == result.squaredDistances[m - 1] &&
                              result.indices[m] < result.indices[m - 1];
           --m)
        std::swap(result.indices[m], result.indices[m - 1]);
    return found;
  }

  static PointXYZ toPoint(const Eigen::Vector3f& position) { return {position.x(), position.y(), position.z()}; }

  search::KdTree<PointXYZ> tree_;
};

/// Positions per piece of parallel work: a few milliseconds of queries.
constexpr std::int64_t searchGrain = 1024;

} // namespace

void NeighborSearch::setPoints(const std::vector<Eigen::Vector3f>& positions, Execution&)
{
  setPoints(positions);
}

void NeighborSearch::dropPoints(const std::vector<Eigen::Vector3f>& left, const std::vector<std::uint8_t>&,
                                Execution& execution)
{
  setPoints(left, execution);
}

void NeighborSearch::forEachPosition(const std::vector<Eigen::Vector3f>& positions, int k, Answer answer,
                                     Execution& execution, const std::function<void(const NeighborBatch&)>& visit) const
{
  const std::size_t wanted = std::max(k, 0);
  execution.forRange(positions.size(), searchGrain, [&](std::int64_t begin, std::int64_t end) {
    Neighbors found;
    std::vector<std::uint32_t> indices(wanted);
    for (std::int64_t i = begin; i < end; ++i) {
      const int number = nearest(positions[i], k, found);
      found.squaredDistances.resize(wanted, std::numeric_limits<float>::infinity());
      for (std::size_t n = 0; n < wanted; ++n)
        indices[n] = n < static_cast<std::size_t>(number) ? static_cast<std::uint32_t>(found.indices[n]) : 0;
      const auto position = static_cast<std::uint32_t>(i);
      NeighborBatch batch;
      batch.size = 1;
      batch.k = wanted;
      batch.positions = &position;
      batch.squaredDistances = found.squaredDistances.data();
      batch.indices = answer == Answer::distances ? nullptr : indices.data();
      visit(batch);
    }
  });
}

std::unique_ptr<NeighborSearch> makeKdTree()
{
  return std::make_unique<KdTree>();
}

std::unique_ptr<NeighborSearch> makeSearch(SearchKind kind)
{
  return kind == SearchKind::kdTree ? makeKdTree() : makePointBins();
}

PointCloud<PointXYZ>::Ptr toPclCloud(const std::vector<Eigen::Vector3f>& positions)
{
  auto cloud = std::make_shared<PointCloud<PointXYZ>>();
  cloud->reserve(positions.size());
  for (const Eigen::Vector3f& position : positions)
    cloud->push_back(PointXYZ(position.x(), position.y(), position.z()));
  return cloud;
}

template <typename Query>
int SearchForPcl::answer(Indices& indices, std::vector<float>& distances, const Query& query) const
{
  if (hasFailed_)
    return 0;
  try {
    Neighbors found{std::move(indices), std::move(distances)};
    const int number = query(found);
    indices = std::move(found.indices);
    distances = std::move(found.squaredDistances);
    return number;
  } catch (...) {
    if (!hasFailed_.exchange(true))
      error_ = std::current_exception();
    return 0;
  }
}

int SearchForPcl::nearestKSearch(const PointXYZ& point, int k, Indices& indices, std::vector<float>& distances) const
{
  return answer(indices, distances,
                [&](Neighbors& found) { return search_.nearest(point.getVector3fMap(), k, found); });
}

int SearchForPcl::radiusSearch(const PointXYZ& point, double radius, Indices& indices, std::vector<float>& distances,
                               unsigned int) const
{
  return answer(indices, distances, [&](Neighbors& found) {
    return search_.within(point.getVector3fMap(), static_cast<float>(radius), found);
  });
}

void SearchForPcl::rethrow() const
{
  if (error_)
    std::rethrow_exception(error_);
}

} // namespace pcl::mrf

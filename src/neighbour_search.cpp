#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/surface/mrf/neighbour_search.h>

namespace pcl {
namespace mrf {
namespace {

class KdTree : public NeighbourSearch {
public:
  void setPoints(const std::vector<Eigen::Vector3f>& positions) override
  {
    auto cloud = std::make_shared<PointCloud<PointXYZ>>();
    cloud->reserve(positions.size());
    for (const Eigen::Vector3f& position : positions)
      cloud->push_back(PointXYZ(position.x(), position.y(), position.z()));
    tree_.setInputCloud(cloud);
  }

  int nearest(const Eigen::Vector3f& query, int k, Neighbours& result) const override
  {
    return tree_.nearestKSearch(toPoint(query), k, result.indices, result.squaredDistances);
  }

  int within(const Eigen::Vector3f& query, float radius, Neighbours& result) const override
  {
    return tree_.radiusSearch(toPoint(query), radius, result.indices, result.squaredDistances);
  }

private:
  static PointXYZ toPoint(const Eigen::Vector3f& position) { return {position.x(), position.y(), position.z()}; }

  KdTreeFLANN<PointXYZ> tree_;
};

} // namespace

std::unique_ptr<NeighbourSearch> makeKdTree()
{
  return std::make_unique<KdTree>();
}

} // namespace mrf
} // namespace pcl

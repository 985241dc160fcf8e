// SPDX-License-Identifier: BSD-3-Clause
/// The graph that normals are oriented along, and the tree of its best edges.
#pragma once

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>

#include "base/disjoint_sets.h"
#include "points/reach.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

namespace pcl::mrf {

/// An edge this close to both normals (cosine) leads from one sheet to another, not along a surface.
constexpr float alongNormals = .9f;

/// Union-find that also keeps the sign of each element relative to its root.
class SignedForest {
public:
  explicit SignedForest(std::size_t count) : parent_(count), isFlipped_(count, 0), size_(count, 1)
  {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }

  std::uint32_t root(std::uint32_t i);

  /// The same without shortening the path to the root, for concurrent readers.
  std::uint32_t rootOf(std::uint32_t i) const
  {
    while (parent_[i] != i)
      i = parent_[i];
    return i;
  }

  /// \pre root(i) was called since the last join
  bool isFlipped(std::uint32_t i) const { return isFlipped_[i] != 0; }

  /// Joins the trees of i and j so that their signs are opposite or equal. \return false if they were one tree
  bool join(std::uint32_t i, std::uint32_t j, bool opposite);

  std::uint32_t size(std::uint32_t i) { return size_[root(i)]; }

private:
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint8_t> isFlipped_; ///< relative to the parent
  std::vector<std::uint32_t> size_;     ///< valid at roots
};

struct Edge {
  std::uint32_t a, b;
  float quality;     ///< how far the relative sign can be trusted, 0..1
  bool opposite;     ///< the two normals point to opposite sides
  bool withinAngle;  ///< the paper's criterion: the angle between the normals is within the limit
  bool acrossSheets; ///< the edge leads along both normals, not along the surface
};

/// One number that sorts edges by badness, then by their place in the graph. The badness, a float from 0 to 1, takes 30
/// bits; the place takes the other 34.
namespace edge_key {

constexpr int placeBits = 34;

std::uint64_t of(float quality, std::size_t place);

inline std::size_t placeOf(std::uint64_t key)
{
  return key & ((std::uint64_t{1} << placeBits) - 1);
}

} // namespace edge_key

/// Edges from each point to its nearest neighbors, and further edges that connectivity needs.
///
/// An edge is a place in the table of neighbors. Its grade is computed whenever it is needed, and only a byte of it is
/// kept. The graph takes about 65 bytes per point.
class OrientationGraph {
public:
  /// \param normals unit length; points with a zero normal have no edges \param minCosine of Edge::withinAngle
  /// \param visit called once for each edge, concurrently and in any order
  /// \throw ResourceLimit above 1.4 thousand million points
  OrientationGraph(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const NeighborSearch& search,
                   const Reach& reach, float minCosine, const std::function<void(const Edge&)>& visit,
                   Execution& execution);

  /// \throw ResourceLimit if the edges of `points` points and moreEdges further ones need more places than a key holds
  static void requireRoom(std::size_t points, std::size_t moreEdges = 0);

  /// Takes out of the graph the area that each point stands for, about, up to one common factor.
  std::vector<float> takeAreas() { return std::move(areas_); }

  /// The edge between two points, whether or not it is in the graph.
  Edge grade(std::uint32_t a, std::uint32_t b) const;

  /// The trees of the best edges for which isUsed is true, joined best first; equal ones in the order of their points.
  SignedForest bestTree(const std::function<bool(const Edge&, SignedForest&)>& isUsed, Execution& execution) const;

private:
  static constexpr std::size_t maxNeighbors = 12;
  static constexpr std::uint32_t noPoint = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::uint8_t noEdge = 255, lastBucket = 200;

  bool hasNormal(std::size_t i) const { return !normals_[i].isZero(); }
  std::pair<std::uint32_t, std::uint32_t> ends(std::size_t place) const;
  static std::uint8_t bucketOf(const Edge& edge);

  void findNeighbors(const NeighborSearch& search, const Reach& reach, Execution& execution);
  void sortIntoBuckets(const std::function<void(const Edge&)>& visit, DisjointSets& connected, Execution& execution);
  void connectPieces(const NeighborSearch& search, const Reach& reach, const std::function<void(const Edge&)>& visit,
                     DisjointSets& connected, Execution& execution);
  std::vector<std::uint64_t> collect(int first, int last, const SignedForest& forest, Execution& execution) const;

  const std::vector<Eigen::Vector3f>& positions_;
  const std::vector<Eigen::Vector3f>& normals_;
  float minCosine_;
  std::vector<std::uint32_t> neighbors_;                      ///< maxNeighbors places per point, nearest first
  std::vector<std::pair<std::uint32_t, std::uint32_t>> more_; ///< edges for connectivity: the places after neighbors_
  std::vector<std::uint8_t> buckets_;                         ///< per place: the coarse badness of its edge
  std::vector<float> areas_;
};

} // namespace pcl::mrf

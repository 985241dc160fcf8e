// SPDX-License-Identifier: BSD-3-Clause
#include "base/loops.h"
#include "remesher/passes.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// Weight of squared distances from former vertices, relative to those from former triangles. It decides where
/// triangles are flat, and prevents needles there; at 1e-4 a head of 20,000 triangles is 1 % farther off.
constexpr double regularity = 1e-6;

/// A sum of weighted squared distances from planes and points, as a function of the position.
struct Quadric {
  Matrix3d matrix = Matrix3d::Zero();
  Vector3d linear = Vector3d::Zero();
  double constant = 0;

  void addPlane(const Vector3d& normal, const Vector3d& point, double weight)
  {
    const double offset = normal.dot(point);
    matrix += weight * normal * normal.transpose();
    linear -= weight * offset * normal;
    constant += weight * offset * offset;
  }
  void addPoint(const Vector3d& point, double weight)
  {
    matrix.diagonal().array() += weight;
    linear -= weight * point;
    constant += weight * point.squaredNorm();
  }
  void add(const Quadric& other)
  {
    matrix += other.matrix;
    linear += other.linear;
    constant += other.constant;
  }
  double at(const Vector3d& x) const { return x.dot(matrix * x) + 2 * linear.dot(x) + constant; }
};

/// An edge in the queue; out of date once either of its ends has changed.
struct Candidate {
  double cost;
  std::int32_t from, to;
  std::uint32_t stamp; ///< changes of both ends so far

  bool operator>(const Candidate& other) const
  {
    return std::tie(cost, from, to) > std::tie(other.cost, other.from, other.to);
  }
};

/// Collapses the edges of a mesh in the order of their costs.
class Decimation {
public:
  Decimation(RemeshedSurface& surface, Execution& execution)
      : surface_(surface), mesh_(surface.mesh), execution_(execution), quadrics_(mesh_.positions.size()),
        stamps_(mesh_.positions.size(), 0)
  {
    surface_.logs.resize(1);
    if (!mesh_.positions.empty())
      origin_ = mesh_.positions.front();
    sumUp();
    enqueueAll();
  }

  /// \param triangles number of triangles to leave
  void run(std::int64_t triangles)
  {
    std::int64_t count = mesh_.halfEdgeCount() / 3;
    Poller poll(execution_);
    while (count > triangles && !queue_.empty()) {
      poll();
      const Candidate candidate = queue_.top();
      queue_.pop();
      if (stamps_[candidate.from] + stamps_[candidate.to] != candidate.stamp)
        continue;
      const std::int32_t h = halfEdgeOf(candidate);
      if (h < 0)
        continue;
      const int gone = mesh_.twin[h] < 0 ? 1 : 2;
      if (collapse(h)) {
        count -= gone;
        ++surface_.result.collapses;
      } else {
        ++surface_.result.refusedOperations;
      }
    }
  }

private:
  Vector3d local(const Vector3f& position) const { return (position - origin_).cast<double>(); }

  std::vector<double> weightsOfVertices()
  {
    constexpr std::int64_t grain = 1024;
    std::vector<double> weights(mesh_.positions.size(), 1);
    if (surface_.weightAt)
      forEachPolling<std::int32_t>(execution_, weights.size(), grain,
                                   [&](std::int32_t v) { weights[v] = surface_.weightAt(mesh_.positions[v]); });
    return weights;
  }

  void sumUp()
  {
    const std::vector<double> weights = weightsOfVertices();
    Poller poll(execution_);
    for (std::int32_t t = 0; t < mesh_.halfEdgeCount(); t += 3) {
      poll();
      const double weight =
          (weights[mesh_.origin[t]] + weights[mesh_.origin[t + 1]] + weights[mesh_.origin[t + 2]]) / 3;
      const Vector3d cross = surface_.cross(t).cast<double>();
      const double length = cross.norm(), area = .5 * length * weight;
      const Vector3d normal = length > 0 ? Vector3d(cross / length) : Vector3d::Zero();
      for (std::int32_t h = t; h < t + 3; ++h) {
        const Vector3d a = local(mesh_.positions[mesh_.origin[h]]), b = local(mesh_.positions[mesh_.target(h)]);
        Quadric& quadric = quadrics_[mesh_.origin[h]];
        quadric.addPlane(normal, a, area / 3);
        quadric.addPoint(a, regularity * area / 3);
        if (mesh_.twin[h] < 0) { // keeps the border's course within the surface
          const Vector3d sideways = normal.cross(b - a);
          const double width = sideways.norm();
          if (width > 0)
            for (const std::int32_t v : {mesh_.origin[h], mesh_.target(h)})
              quadrics_[v].addPlane(sideways / width, a, .5 * width * width * weight);
        }
      }
    }
  }

  void enqueueAll()
  {
    std::vector<Candidate> candidates;
    for (std::int32_t h = 0; h < mesh_.halfEdgeCount(); ++h)
      if (const auto candidate = mesh_.represents(h) ? candidateOf(h) : std::nullopt)
        candidates.push_back(*candidate);
    queue_ = decltype(queue_)(std::greater<>(), std::move(candidates));
  }

  std::optional<Candidate> candidateOf(std::int32_t h) const
  {
    const std::int32_t a = mesh_.origin[h], b = mesh_.target(h);
    if (mesh_.pinned[a] || mesh_.pinned[b])
      return {};
    const double cost = sumOf(a, b).at(placeOf(h));
    if (!std::isfinite(cost)) // if triangles have no area
      return {};
    return Candidate{cost, std::min(a, b), std::max(a, b), stamps_[a] + stamps_[b]};
  }

  void enqueue(std::int32_t h)
  {
    if (const std::optional<Candidate> candidate = candidateOf(h))
      queue_.push(*candidate);
  }

  Quadric sumOf(std::int32_t a, std::int32_t b) const
  {
    Quadric sum = quadrics_[a];
    sum.add(quadrics_[b]);
    return sum;
  }

  /// Position of the merged vertex, relative to origin_: the end on the border, if only one end is there.
  Vector3d placeOf(std::int32_t h) const
  {
    const std::int32_t a = mesh_.origin[h], b = mesh_.target(h);
    if (mesh_.twin[h] >= 0 && mesh_.onBoundary(a) != mesh_.onBoundary(b))
      return local(mesh_.positions[mesh_.onBoundary(a) ? a : b]);
    const Quadric sum = sumOf(a, b);
    return Vector3d(sum.matrix.llt().solve(-sum.linear));
  }

  /// A half-edge of the candidate's edge; −1 if the edge is gone.
  std::int32_t halfEdgeOf(const Candidate& candidate) const
  {
    std::int32_t found = -1;
    for (const auto& [v, w] : {std::pair(candidate.from, candidate.to), std::pair(candidate.to, candidate.from)})
      if (found < 0 && mesh_.outgoing[v] >= 0 && mesh_.outgoing[w] >= 0)
        mesh_.forOutgoing(v, [&, w = w](std::int32_t h) {
          if (mesh_.target(h) == w)
            found = h;
        });
    return found;
  }

  /// True if no triangle that stays is spoiled.
  bool fits(std::int32_t h, const Corner& merged) const
  {
    const std::int32_t g = mesh_.twin[h];
    bool fits = true;
    for (const std::int32_t end : {mesh_.origin[h], mesh_.target(h)})
      mesh_.forOutgoing(end, [&](std::int32_t spoke) {
        if (fits && spoke / 3 != h / 3 && (g < 0 || spoke / 3 != g / 3))
          fits = TriangleShape(merged, surface_.corner(mesh_.target(spoke)), surface_.corner(mesh_.opposite(spoke)))
                     .mayReplace(surface_.shape(spoke), std::numeric_limits<float>::infinity());
      });
    return fits;
  }

  /// \return false if it is refused
  bool collapse(std::int32_t edge)
  {
    const std::int32_t h = surface_.towardsWhatGoes(edge);
    const std::int32_t a = mesh_.origin[h], b = mesh_.target(h);
    if (!mesh_.mayCollapse(h))
      return false;
    const Vector3f position = origin_ + placeOf(h).cast<float>();
    const Corner merged{position,
                        surface_.level.normalAt(position, (mesh_.normals[a] + mesh_.normals[b]).normalized())};
    if (!position.allFinite() || !fits(h, merged))
      return false;
    surface_.merge(h, {merged, surface_.site(a).place}, surface_.logs.back());
    quadrics_[a].add(quadrics_[b]);
    ++stamps_[a];
    ++stamps_[b];
    mesh_.forOutgoing(a, [&](std::int32_t spoke) {
      enqueue(spoke);
      if (mesh_.twin[HalfEdgeMesh::previous(spoke)] < 0) // else it is the twin of another spoke
        enqueue(HalfEdgeMesh::previous(spoke));
    });
    return true;
  }

  RemeshedSurface& surface_;
  HalfEdgeMesh& mesh_;
  Execution& execution_;
  Vector3f origin_ = Vector3f::Zero(); ///< of the quadrics, which lose digits far from it
  std::vector<Quadric> quadrics_;
  std::vector<std::uint32_t> stamps_;
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue_;
};

} // namespace

void decimate(RemeshedSurface& surface, std::int64_t triangles, Execution& execution)
{
  Decimation(surface, execution).run(triangles);
}

} // namespace pcl::mrf

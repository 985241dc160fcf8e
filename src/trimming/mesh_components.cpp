// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/mesh_components.h"

#include "base/loops.h"
#include "base/select_values.h"
#include "mesh/mesh_topology.h"
#include "trimming/lines_of_sight.h"

#include <pcl/surface/mrf/options.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

namespace pcl::mrf {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

/// Max number of supported vertices per component whose nearest points are tested.
constexpr std::size_t maxAsked = 1024;

/// Some supported vertices of each component, spread evenly over all of them.
std::vector<std::vector<std::int32_t>>
pickVertices(const TriangleMesh& mesh, const std::vector<std::int32_t>& componentOf, std::size_t components)
{
  std::vector<std::vector<std::int32_t>> picked(components);
  std::vector<std::uint8_t> isSeen(mesh.vertices.size(), 0);
  for (std::size_t t = 0; t < componentOf.size(); ++t) {
    if (componentOf[t] < 0)
      continue;
    for (const std::int32_t v : mesh.triangles[t])
      if (!isSeen[v] && mesh.confidences[v] > 0) {
        isSeen[v] = 1;
        picked[componentOf[t]].push_back(v);
      }
  }
  for (std::vector<std::int32_t>& vertices : picked)
    vertices = selectValues(vertices, spreadIndices(vertices.size(), maxAsked));
  return picked;
}

/// Counts the points that support a component of the mesh: those that are behind it and coherent, as src/method.md
/// says. They are apart if their two nearest neighbors of these are closer than any other component, and within some
/// spacings.
class ComponentSupport {
public:
  ComponentSupport(const TriangleMesh& mesh, const OrientedPoints& points, const NeighborSearch& search,
                   const std::vector<std::int32_t>& componentOf, Execution& execution)
      : mesh_(mesh), points_(points), search_(search), vertexSearch_(makePointBins()),
        componentOfVertex_(mesh.vertices.size(), -1)
  {
    for (std::size_t t = 0; t < componentOf.size(); ++t)
      if (componentOf[t] >= 0)
        for (const std::int32_t v : mesh.triangles[t])
          componentOfVertex_[v] = componentOf[t];
    vertexSearch_->setPoints(mesh.vertices, execution);
  }

  /// True if `min` coherent points are found at the vertices, or `minPointsApart` of them apart.
  bool isEnough(std::int32_t component, const std::vector<std::int32_t>& vertices, std::size_t min,
                std::size_t minPointsApart) const
  {
    std::vector<int> asked;
    std::size_t coherent = 0, apart = 0;
    Neighbors nearest;
    for (const std::int32_t v : vertices) {
      if (search_.nearest(mesh_.vertices[v], 1, nearest) < 1)
        continue;
      const int point = nearest.indices.front();
      if (std::find(asked.begin(), asked.end(), point) != asked.end())
        continue;
      asked.push_back(point);
      if (nearestComponent(point, nearest) != component)
        continue;
      const Company company = findCompany(point, component, nearest);
      if (!(company.reach > 0))
        continue;
      ++coherent;
      apart += company.reach <= maxReach * company.spacingBeside && isAlone(point, component, company.reach, nearest);
      if (coherent >= min || apart >= minPointsApart)
        return true;
    }
    return false;
  }

  /// The points behind a component that are the nearest of its given vertices.
  std::vector<std::uint32_t> pointsBehind(std::int32_t component, const std::vector<std::int32_t>& vertices) const
  {
    std::vector<std::uint32_t> behind;
    Neighbors nearest;
    for (const std::int32_t v : vertices)
      if (search_.nearest(mesh_.vertices[v], 1, nearest) == 1)
        behind.push_back(static_cast<std::uint32_t>(nearest.indices.front()));
    std::sort(behind.begin(), behind.end());
    behind.erase(std::unique(behind.begin(), behind.end()), behind.end());
    const auto isElsewhere = [&](std::uint32_t i) {
      return nearestComponent(static_cast<int>(i), nearest) != component;
    };
    behind.erase(std::remove_if(behind.begin(), behind.end(), isElsewhere), behind.end());
    return behind;
  }

  /// The component that a point is behind, or -1.
  std::int32_t nearestComponent(int point, Neighbors& scratch) const
  {
    vertexSearch_->nearest(points_.positions[point], 1, scratch);
    return componentOfVertex_[scratch.indices.front()];
  }

private:
  /// The neighbors of a point.
  struct Company {
    float reach = 0; ///< distance of the second agreeing one behind the component; 0 if the point is not coherent
    float spacingBeside = infinity; ///< min spacing of those behind another component
  };

  Company findCompany(int point, std::int32_t component, Neighbors& scratch) const
  {
    constexpr int around = 8;
    Neighbors neighbors;
    search_.nearest(points_.positions[point], around + 1, neighbors);
    int behind = 0, agreeing = 0;
    Company company;
    for (std::size_t n = 0; n < neighbors.indices.size(); ++n) {
      const int other = neighbors.indices[n];
      if (neighbors.squaredDistances[n] == 0)
        continue;
      if (nearestComponent(other, scratch) != component) {
        if (!points_.spacings.empty())
          company.spacingBeside = std::min(company.spacingBeside, points_.spacings[other]);
        continue;
      }
      ++behind;
      if (points_.normals[other].dot(points_.normals[point]) > minAgreement && ++agreeing == 2)
        company.reach = std::sqrt(neighbors.squaredDistances[n]);
    }
    if (3 * agreeing < behind)
      company.reach = 0;
    return company;
  }

  bool isAlone(int point, std::int32_t component, float reach, Neighbors& scratch) const
  {
    vertexSearch_->within(points_.positions[point], reach, scratch);
    return std::all_of(scratch.indices.begin(), scratch.indices.end(),
                       [&](int v) { return componentOfVertex_[v] == component; });
  }

  /// Cosine of 40°: one in nine pairs of random directions agrees, one in 70 triples.
  static constexpr float minAgreement = .766f;

  static constexpr float maxReach = 6; ///< in spacings; clumps of outliers mostly reach farther

  const TriangleMesh& mesh_;
  const OrientedPoints& points_;
  const NeighborSearch& search_;
  const std::unique_ptr<NeighborSearch> vertexSearch_;
  std::vector<std::int32_t> componentOfVertex_;
};

/// Min number of coherent points apart in a surface, such as a lone corner or a strip of one line of a range scan.
constexpr std::size_t minPointsApart = 3;

/// Max share of a component's points at which lines of sight contradict it.
constexpr double maxContradicted = .6;

/// Flags of the components that too few points support, however large they are.
std::vector<std::uint8_t> findPoorComponents(const ComponentSupport& support,
                                             const std::vector<std::vector<std::int32_t>>& picked, std::size_t min,
                                             Execution& execution)
{
  std::vector<std::uint8_t> isPoor(picked.size(), 0);
  forEach(execution, picked.size(), 1, [&](std::size_t c) {
    isPoor[c] = support.isEnough(static_cast<std::int32_t>(c), picked[c], min, minPointsApart) ? 0 : 1;
  });
  return isPoor;
}

/// Drops the components most of whose points lines of sight contradict: larger ones are seen through them, or hide
/// them. \param min fewer points tell too little
void dropContradicted(const ComponentSupport& support, const std::vector<std::vector<std::int32_t>>& picked,
                      const std::vector<double>& areas, const OrientedPoints& points, std::size_t min,
                      std::vector<std::uint8_t>& isDropped, Execution& execution)
{
  const double largest = *std::max_element(areas.begin(), areas.end());
  const auto numberOf = [&](std::uint32_t point) {
    Neighbors nearest;
    const std::int32_t number = support.nearestComponent(static_cast<int>(point), nearest);
    return number >= 0 && isDropped[number] ? -1 : number;
  };
  std::vector<std::uint32_t> asked;
  std::vector<std::size_t> ends;
  for (std::size_t c = 0; c < picked.size(); ++c) {
    if (!isDropped[c] && areas[c] < largest) {
      const std::vector<std::uint32_t> behind = support.pointsBehind(static_cast<std::int32_t>(c), picked[c]);
      if (behind.size() >= min)
        asked.insert(asked.end(), behind.begin(), behind.end());
    }
    ends.push_back(asked.size());
  }
  const std::vector<std::uint8_t> flags = contradicted(asked, {numberOf, areas}, points, execution);
  for (std::size_t c = 0, begin = 0; c < picked.size(); begin = ends[c++]) {
    const auto count = std::count(flags.begin() + begin, flags.begin() + ends[c], std::uint8_t{1});
    if (static_cast<double>(count) > maxContradicted * static_cast<double>(ends[c] - begin))
      isDropped[c] = 1;
  }
}

} // namespace

std::int64_t dropSmallComponents(const ObservedMesh& observed, const OrientedPoints& points,
                                 const NeighborSearch& search, const TrimmingOptions& options,
                                 std::vector<std::uint8_t>& keep, bool& isTorn, Execution& execution)
{
  const auto& [mesh, supported] = observed;
  std::vector<std::int32_t> componentOf;
  const std::int32_t components = groupTriangles(mesh, keep, execution, componentOf, isTorn);
  const auto min = static_cast<std::size_t>(options.minComponentPoints);
  if (components < 2 || min < 2)
    return 0;
  std::vector<double> area(components, 0);
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (keep[t] && supported[t])
      area[componentOf[t]] += areaOf(mesh, mesh.triangles[t]);
  const std::vector<std::vector<std::int32_t>> picked = pickVertices(mesh, componentOf, area.size());
  const ComponentSupport support(mesh, points, search, componentOf, execution);
  std::vector<std::uint8_t> isDropped = findPoorComponents(support, picked, min, execution);
  if (!points.spacings.empty() && !points.sensors.empty())
    dropContradicted(support, picked, area, points, min, isDropped, execution);
  isDropped[std::max_element(area.begin(), area.end()) - area.begin()] = 0;
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (keep[t] && isDropped[componentOf[t]])
      keep[t] = 0;
  return std::count(isDropped.begin(), isDropped.end(), std::uint8_t{1});
}

} // namespace pcl::mrf

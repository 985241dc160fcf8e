#include "support/lattice_mesh.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace shapes {

using Eigen::Vector3d;
using Eigen::Vector3f;
using pcl::mrf::DistanceField;
using pcl::mrf::GridSize;
using pcl::mrf::Triangle;
using pcl::mrf::TriangleMesh;

TriangleMesh marchTetrahedra(const DistanceField& field)
{
  // The six tetrahedra around the diagonal of a cell: corner 0, then the axes in each order, then corner 7.
  constexpr int tetrahedra[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
  const GridSize size = field.lattice().size;
  TriangleMesh mesh;
  std::map<std::pair<std::int64_t, std::int64_t>, std::int32_t> vertices;

  for (int k = 0; k + 1 < size.z; ++k)
    for (int j = 0; j + 1 < size.y; ++j)
      for (int i = 0; i + 1 < size.x; ++i) {
        std::array<std::int64_t, 8> index;
        std::array<Vector3f, 8> position;
        std::array<float, 8> value;
        for (int c = 0; c < 8; ++c) {
          const int x = i + (c & 1), y = j + (c >> 1 & 1), z = k + (c >> 2);
          index[c] = size.index(x, y, z);
          position[c] = field.lattice().position(x, y, z);
          value[c] = field.distance(x, y, z);
        }
        const auto vertexBetween = [&](int a, int b) {
          const auto key = std::minmax(index[a], index[b]);
          const auto found = vertices.find(key);
          if (found != vertices.end())
            return found->second;
          if (index[a] > index[b])
            std::swap(a, b);
          const float t = std::clamp(value[a] / (value[a] - value[b]), .01f, .99f);
          mesh.vertices.push_back(position[a] + t * (position[b] - position[a]));
          return vertices[key] = static_cast<std::int32_t>(mesh.vertices.size()) - 1;
        };
        for (const auto& tetrahedron : tetrahedra) {
          std::vector<int> inside, outside;
          for (const int c : tetrahedron)
            (value[c] < 0 ? inside : outside).push_back(c);
          if (inside.empty() || outside.empty())
            continue;
          Vector3f outward = Vector3f::Zero();
          for (const int c : outside)
            outward += position[c] / static_cast<float>(outside.size());
          for (const int c : inside)
            outward -= position[c] / static_cast<float>(inside.size());
          std::vector<Vector3f> corners; // of the exact middle cut, to orient by: never degenerate
          std::vector<std::int32_t> polygon;
          const auto add = [&](int a, int b) {
            corners.push_back(.5f * (position[a] + position[b]));
            polygon.push_back(vertexBetween(a, b));
          };
          if (inside.size() == 2) {
            add(inside[0], outside[0]);
            add(inside[0], outside[1]);
            add(inside[1], outside[1]);
            add(inside[1], outside[0]);
          } else {
            const int apex = inside.size() == 1 ? inside[0] : outside[0];
            for (const int c : inside.size() == 1 ? outside : inside)
              add(apex, c);
          }
          const bool turned = (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(outward) < 0;
          for (std::size_t c = 1; c + 1 < polygon.size(); ++c)
            mesh.triangles.push_back(turned ? Triangle{polygon[0], polygon[c + 1], polygon[c]}
                                            : Triangle{polygon[0], polygon[c], polygon[c + 1]});
        }
      }
  return mesh;
}

Census takeCensus(const TriangleMesh& mesh)
{
  Census census;
  census.triangles = static_cast<int>(mesh.triangles.size());
  std::map<std::pair<std::int32_t, std::int32_t>, std::vector<int>> edges; // +1 from small to large index, −1 back
  std::map<std::int32_t, std::vector<std::pair<std::int32_t, std::int32_t>>> links;
  std::set<std::array<std::int32_t, 3>> known;
  std::vector<double> areas;
  census.minQuality = 1;
  for (const Triangle& t : mesh.triangles) {
    Triangle sorted = t;
    std::sort(sorted.begin(), sorted.end());
    census.duplicates += known.insert(sorted).second ? 0 : 1;
    std::array<Vector3d, 3> p;
    for (int i = 0; i < 3; ++i) {
      p[i] = mesh.vertices.at(t[i]).cast<double>();
      const std::int32_t a = t[i], b = t[(i + 1) % 3];
      edges[std::minmax(a, b)].push_back(a < b ? 1 : -1);
      links[a].push_back({b, t[(i + 2) % 3]});
    }
    const double a = (p[1] - p[0]).norm(), b = (p[2] - p[1]).norm(), c = (p[0] - p[2]).norm();
    const double area = .5 * (p[1] - p[0]).cross(p[2] - p[0]).norm();
    // inradius = 2 area / perimeter, circumradius = abc / (4 area)
    const double quality = 2 * (2 * area / (a + b + c)) * (4 * area) / (a * b * c);
    census.degenerate += !(quality > 1e-6) || sorted[0] == sorted[1] || sorted[1] == sorted[2] ? 1 : 0;
    census.minQuality = std::min(census.minQuality, quality);
    census.meanQuality += quality / census.triangles;
    areas.push_back(area);
    census.area += area;
  }
  for (const double area : areas)
    census.areaDeviation += std::pow(area * census.triangles / census.area - 1, 2) / census.triangles;
  census.areaDeviation = std::sqrt(census.areaDeviation);

  std::map<std::int32_t, int> valences;
  for (const auto& [ends, uses] : edges) {
    ++census.edges;
    ++valences[ends.first];
    ++valences[ends.second];
    census.boundaryEdges += uses.size() == 1 ? 1 : 0;
    census.badEdges += uses.size() > 2 || (uses.size() == 2 && uses[0] == uses[1]) ? 1 : 0;
    census.meanEdge += (mesh.vertices[ends.first] - mesh.vertices[ends.second]).norm();
  }
  census.meanEdge /= std::max(census.edges, 1);
  census.vertices = static_cast<int>(links.size());
  for (const auto& [vertex, link] : links) {
    census.regularShare += valences[vertex] == 6 ? 1.0 / census.vertices : 0;
    // One fan: the link is one path or one cycle, so that a walk over it meets all its edges.
    std::map<std::int32_t, std::int32_t> following(link.begin(), link.end());
    std::set<std::int32_t> ends;
    for (const auto& step : link)
      ends.insert(step.second);
    std::int32_t start = link.front().first;
    for (const auto& step : link)
      if (ends.count(step.first) == 0)
        start = step.first;
    std::size_t met = 0;
    for (auto step = following.find(start); step != following.end() && met < link.size(); ++met)
      step = following.find(step->second);
    census.badVertices += met != link.size() || following.size() != link.size() ? 1 : 0;
  }
  return census;
}

} // namespace shapes

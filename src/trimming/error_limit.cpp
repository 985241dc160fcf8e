// SPDX-License-Identifier: BSD-3-Clause
#include "mesh/mesh_topology.h"
#include "trimming/trimming.h"

#include <pcl/surface/mrf/report.h>

#include <algorithm>
#include <vector>

namespace pcl::mrf {
namespace {

/// Flags of the triangles that stay.
std::vector<std::uint8_t> flagsWithin(const TriangleMesh& mesh, float maxSigma)
{
  std::vector<std::uint8_t> keep(mesh.triangles.size()), isInner(mesh.vertices.size(), 1);
  for (std::size_t t = 0; t < keep.size(); ++t) {
    const Triangle& corners = mesh.triangles[t];
    keep[t] = std::all_of(corners.begin(), corners.end(), [&](std::int32_t v) { return mesh.sigmas[v] <= maxSigma; });
    if (keep[t] == 0)
      for (const std::int32_t v : corners)
        isInner[v] = 0;
  }
  for (std::size_t t = 0; t < keep.size(); ++t)
    if (const Triangle& c = mesh.triangles[t]; keep[t] != 0)
      keep[t] = isInner[c[0]] != 0 || isInner[c[1]] != 0 || isInner[c[2]] != 0;
  return keep;
}

} // namespace

ErrorLimitSummary limitSigma(TriangleMesh& mesh, float maxSigma)
{
  const std::vector<std::uint8_t> keep = flagsWithin(mesh, maxSigma);
  ErrorLimitSummary dropped;
  for (std::size_t t = 0; t < keep.size(); ++t) {
    if (keep[t] != 0)
      continue;
    const Triangle& corners = mesh.triangles[t];
    const double area = areaOf(mesh, corners);
    ++dropped.triangles;
    dropped.area += area;
    if (std::any_of(corners.begin(), corners.end(), [&](std::int32_t v) { return mesh.confidences[v] > 0; }))
      dropped.measuredArea += area;
  }
  if (dropped.triangles > 0) {
    mesh = select(mesh, keep);
    splitFans(mesh);
  }
  return dropped;
}

} // namespace pcl::mrf

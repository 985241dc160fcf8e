// SPDX-License-Identifier: BSD-3-Clause
#include "trimming/trimming.h"

#include "mesh/mesh_topology.h"
#include "options/validation.h"
#include "trimming/hole_filling.h"
#include "trimming/mesh_components.h"

#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace pcl::mrf {
namespace {

std::vector<std::uint8_t> findSupported(const TriangleMesh& mesh, Execution& execution)
{
  std::vector<std::uint8_t> supported(mesh.triangles.size());
  forTriangles(mesh, execution, [&](std::size_t t) {
    const Triangle& corners = mesh.triangles[t];
    supported[t] = hasValidIndices(mesh, t) && (mesh.confidences[corners[0]] > 0 || mesh.confidences[corners[1]] > 0 ||
                                                mesh.confidences[corners[2]] > 0);
  });
  return supported;
}

/// True if there is nothing to drop, and nothing to split.
bool isOnePiece(const MeshStatistics& statistics)
{
  return statistics.components == 1 && statistics.nonManifoldVertices == 0 && statistics.unusedVertices == 0;
}

/// True if all triangles are kept and use all vertices.
bool isAllUsed(const TriangleMesh& mesh, const std::vector<std::uint8_t>& keep)
{
  const auto isSet = [](std::uint8_t flag) { return flag != 0; };
  if (!std::all_of(keep.begin(), keep.end(), isSet))
    return false;
  std::vector<std::uint8_t> isUsed(mesh.vertices.size(), 0);
  for (const Triangle& t : mesh.triangles)
    for (const std::int32_t v : t)
      isUsed[v] = 1;
  return std::all_of(isUsed.begin(), isUsed.end(), isSet);
}

} // namespace

float resolvedMaxHole(const TrimmingOptions& options, float diagonal)
{
  return options.maxHole > 0 ? options.maxHole : diagonal / 2;
}

float resolvedMaxGap(const TrimmingOptions& options, float diagonal)
{
  return options.maxGap > 0 ? options.maxGap : options.maxHole > 0 ? options.maxHole : .24f * diagonal;
}

TrimResult trim(TriangleMesh mesh, const OrientedPoints& points, const NeighborSearch& search, float diagonal,
                const TrimmingOptions& options, Execution& execution)
{
  validate(options);
  TrimResult result;
  if (options.kind == Trimming::none || mesh.triangles.empty()) {
    result.mesh = std::move(mesh);
    return result;
  }
  if (mesh.confidences.size() != mesh.vertices.size())
    throw std::invalid_argument("trim: needs one confidence per vertex");

  const std::vector<std::uint8_t> supported = findSupported(mesh, execution);
  const auto isSet = [](std::uint8_t flag) { return flag != 0; };
  if (std::all_of(supported.begin(), supported.end(), isSet)) {
    result.statistics = measure(mesh, execution);
    if (isOnePiece(*result.statistics)) { // as most large ones are: the rest would take memory and find nothing
      result.mesh = std::move(mesh);
      return result;
    }
  }
  HoleFinder holes(mesh, supported, points, search, execution);
  std::vector<std::uint8_t> keep(supported);
  if (options.kind == Trimming::holes) {
    const bool isAutomatic = options.maxGap == 0 && options.maxHole == 0;
    keep = holes.keepFillings({resolvedMaxHole(options, diagonal), resolvedMaxGap(options, diagonal), !isAutomatic});
  }
  bool isTorn = false;
  const bool keepsAll = std::all_of(keep.begin(), keep.end(), isSet);
  if (keepsAll && !result.statistics)
    result.statistics = measure(mesh, execution);
  if (!keepsAll || !isOnePiece(*result.statistics))
    result.componentsDropped = dropSmallComponents({mesh, supported}, points, search, options, keep, isTorn, execution);
  if (result.statistics && (result.componentsDropped > 0 || isTorn || result.statistics->unusedVertices > 0))
    result.statistics.reset(); // these hold for the mesh before

  for (std::size_t t = 0; t < keep.size(); ++t)
    if (!keep[t] && hasValidIndices(mesh, t))
      result.areaDropped += areaOf(mesh, mesh.triangles[t]);
  holes.describe(keep, result);
  result.mesh = result.statistics || isAllUsed(mesh, keep) ? std::move(mesh) : select(mesh, keep);
  if (isTorn)
    splitFans(result.mesh);
  return result;
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// One part of a mesh, remeshed as a task.
#pragma once

#include "remesher/piece.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/options.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace pcl::mrf {

/// All that a part is remeshed from. \see MeshPiece, RemeshPlan
struct PartInput {
  TriangleMesh mesh; ///< vertices and triangles
  EdgeSizing sizing;
  std::vector<std::int32_t> numbers;
  std::vector<double> places;
  RemeshPlan plan;   ///< what parts need of it
  float maxStep = 0; ///< \see ReferenceSurface
  RemesherOptions options;
  DistanceField field; ///< at least around the part
};

/// What a part becomes. \see RemeshedPiece
struct PartResult {
  TriangleMesh mesh; ///< vertices and triangles
  std::vector<std::int32_t> numbers;
  EdgeSizing sizing;
  std::vector<double> places;
  std::vector<std::int32_t> intersecting; ///< triangles, ascending
  RemeshSummary summary;
};

constexpr const char* partKind = "part";

/// Remeshes parts: use(n, what became of makeInput(n)), in their order.
/// \throw what remeshPiece does; what TaskRunner::run does
void remeshEach(int count, const std::function<PartInput(int n)>& makeInput,
                const std::function<void(int n, PartResult result)>& use, Execution& execution);

/// One of them, from bytes to bytes.
std::string remeshPart(std::string input, Execution& execution);

} // namespace pcl::mrf

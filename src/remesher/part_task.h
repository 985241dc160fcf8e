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

/// All that a part is remeshed from.
struct PartInput : MeshPiece {
  RemeshPlan plan;   ///< what parts need of it
  float maxStep = 0; ///< \see ZeroLevel
  RemesherOptions options;
  DistanceField field; ///< at least around the part
};

constexpr const char* partKind = "part";

/// Remeshes parts: use(n, what became of makeInput(n)), in their order.
/// \throw what remeshPiece does; what TaskRunner::run does
void remeshEach(int count, const std::function<PartInput(int n)>& makeInput,
                const std::function<void(int n, RemeshedPiece result)>& use, Execution& execution);

/// One of them, from bytes to bytes.
std::string remeshPart(std::string input, Execution& execution);

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// One part of a mesh, remeshed as a task.
#pragma once

#include "remesher/piece.h"

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/options.h>

#include <functional>
#include <string>

namespace pcl::mrf {

/// The input from which a part is remeshed.
struct PartInput : MeshPiece {
  RemeshPlan plan;   ///< a task gets only the fields that parts need
  float maxStep = 0; ///< \see ZeroLevel
  RemesherOptions options;
  DistanceField field; ///< at least around the part
};

constexpr const char* partKind = "part";

/// Remeshes the parts makeInput(n) as tasks and calls use(n, result) in their order.
/// \throw what remeshPiece and TaskRunner::run throw
void remeshEach(int count, const std::function<PartInput(int n)>& makeInput,
                const std::function<void(int n, RemeshedPiece result)>& use, Execution& execution);

/// Remeshes one part: from a serialized PartInput to a serialized RemeshedPiece.
std::string remeshPart(std::string input, Execution& execution);

} // namespace pcl::mrf

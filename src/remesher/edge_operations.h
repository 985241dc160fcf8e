// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The passes of the remesher that change connectivity: split, collapse, flip.
///
/// What to work on is looked for in parallel and done one by one; an operation that would spoil a triangle, the
/// topology or the way along the surface is refused. Edges between pinned vertices are neither made nor removed.
#pragma once

#include "remesher/remeshed_surface.h"

#include <pcl/surface/mrf/execution.h>

namespace pcl {
namespace mrf {

/// Splits edges longer than 4/3 of the target. Those that a split makes wait for the next round.
void splitLongEdges(RemeshedSurface& surface, Execution& execution);

/// Collapses edges shorter than 4/5 of the target.
///
/// The shortest ones first: those next to them may then be long enough. In the order of memory, one vertex would
/// swallow its neighbors one after the other. In classes of a factor √2, each in the order of memory, because what is
/// taken from all over the memory costs twice the time.
void collapseShortEdges(RemeshedSurface& surface, Execution& execution);

/// Flips edges towards valence 6, on the border 4.
void flipEdges(RemeshedSurface& surface, Execution& execution);

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
/// The passes of the remesher.
///
/// What edges to work on is looked for in parallel. They are worked on region by region of the mesh, several regions at
/// a time, and those across regions' borders after them: the same for any number of threads. An operation that would
/// spoil a triangle, the topology or the way along the surface is refused. Edges between pinned vertices are neither
/// made nor removed.
#pragma once

#include "remesher/remeshed_surface.h"

#include <pcl/surface/mrf/execution.h>

namespace pcl::mrf {

/// Before the first round: normals of the surface, where that has none those of the triangles.
void setNormals(RemeshedSurface& surface, Execution& execution);

/// Before the first round: vertices of different parts of the border at one place, where trimming left two fans that
/// touch, move a little into their own fans, as far as their triangles allow.
void partBorders(RemeshedSurface& surface);

/// Those of some vertices that are where another one of them is, place by place.
std::vector<std::int32_t> sharingPlaces(const std::vector<Eigen::Vector3f>& positions,
                                        std::vector<std::int32_t> vertices);

/// Splits edges longer than 4/3 of the target. Those that a split makes wait for the next round. Room that was made for
/// splits that are refused stays until the mesh is compacted.
void splitLongEdges(RemeshedSurface& surface, Execution& execution);

/// Collapses edges shorter than 4/5 of the target.
///
/// The shortest ones first: those next to them may then be long enough. In the order of memory, one vertex would
/// swallow its neighbors one after the other. In classes of a factor √2, each in the order of memory, because what is
/// taken from all over the memory costs twice the time.
void collapseShortEdges(RemeshedSurface& surface, Execution& execution);

/// Flips edges towards valence 6, on the border 4.
void flipEdges(RemeshedSurface& surface, Execution& execution);

/// Moves each vertex towards the centroid of its neighbors on the surface.
///
/// All steps are computed from the same state, in parallel; they are taken one by one, each against the state it meets.
/// Vertices of a region whose neighbors all belong to it move while other regions' do; the rest move after them.
void relax(RemeshedSurface& surface, Execution& execution);

/// After all else: collapses edges until no more triangles are left than asked for, or none may be collapsed.
///
/// Those that move the surface least come first, by Garland and Heckbert's quadrics (SIGGRAPH 1997): the squared
/// distances of the merged vertex from the planes of all triangles that it stands for, weighted by their areas and
/// RemeshedSurface::weightAt, and on the border from planes upright on it. So edges get long where the surface is flat,
/// and stay short where it curves, or where its distance weighs much.
/// \pre no triangle was removed since the mesh was made or compacted
void decimate(RemeshedSurface& surface, std::int64_t triangles, Execution& execution);

/// After the last round: moves vertices along their normals until the middles of edges lie on the surface in the mean.
///
/// Triangles with their corners on a curved surface lie on one side of it: by l²/8R in the mean, for edges of l on a
/// sphere of radius R, where the best ones of that size are off by less than a third of it, to both sides. A quadratic
/// function's mean over a triangle is that of its values at the middles of the edges, so these stand for all of it.
/// Vertices on the border, pinned ones, and those whose triangles would be spoiled stay where they are, and those along
/// sharp edges of the shape nearly so.
void fitToSurface(RemeshedSurface& surface, Execution& execution);

} // namespace pcl::mrf

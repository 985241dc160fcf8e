// SPDX-License-Identifier: BSD-3-Clause
/// The passes of the remesher.
///
/// A pass finds the edges to work on in parallel. It works on several regions of the mesh at a time, then on the edges
/// across regions' borders, so that the result is the same for any number of threads. An operation is refused if it
/// would spoil a triangle or the topology, or let the surface turn too much along an edge. Edges between pinned
/// vertices are neither made nor removed.
#pragma once

#include "remesher/remeshed_surface.h"

#include <pcl/surface/mrf/execution.h>

namespace pcl::mrf {

/// Before the first round: sets the vertices' normals to the surface's; where it has none, to those of the triangles.
void setNormals(RemeshedSurface& surface, Execution& execution);

/// Before the first round: separates border vertices at one position, where trimming left two fans that touch. Each
/// vertex moves a little into its own fan, as far as its triangles allow.
void partBorders(RemeshedSurface& surface);

/// Those of the vertices that share their position with another one of them, sorted by position.
std::vector<std::int32_t> sharingPlaces(const std::vector<Eigen::Vector3f>& positions,
                                        std::vector<std::int32_t> vertices);

/// Splits edges longer than 4/3 of the target. Edges that a split makes wait for the next round. The room of refused
/// splits stays until the mesh is compacted.
void splitLongEdges(RemeshedSurface& surface, Execution& execution);

/// Collapses edges shorter than 4/5 of the target.
///
/// The shortest edges come first: edges next to them may then be long enough. In the order of memory, one vertex would
/// swallow its neighbors one after the other. Lengths within a factor √2 form a class, in which edges are in the order
/// of memory: strictly by length, the pass would jump through the memory and take twice the time.
void collapseShortEdges(RemeshedSurface& surface, Execution& execution);

/// Flips edges towards valence 6, on the border 4.
void flipEdges(RemeshedSurface& surface, Execution& execution);

/// Moves each vertex towards the centroid of its neighbors on the surface.
///
/// All steps are computed in parallel from the same state, then taken one by one, each checked against the current
/// state. Regions concurrently move the vertices whose neighbors are all in the region; the others move after them.
void relax(RemeshedSurface& surface, Execution& execution);

/// After all other passes: collapses edges until at most `triangles` triangles are left, or no edge may collapse.
///
/// Edges that move the surface least come first, by Garland and Heckbert's quadrics (SIGGRAPH 1997): the squared
/// distances of the merged vertex from the planes of all triangles that it replaces, weighted by their areas and
/// RemeshedSurface::weightAt, and on the border also from planes perpendicular to the surface. So edges get long where
/// the surface is flat, and stay short where it curves, or where the weight is large.
/// \pre no triangle was removed since the mesh was made or compacted
void decimate(RemeshedSurface& surface, std::int64_t triangles, Execution& execution);

/// After the last round: moves vertices along their normals until midpoints of edges lie on the surface in the mean.
///
/// Triangles with their corners on a curved surface lie on one side of it: on a sphere of radius R, triangles with
/// edges of length l are off by l²/8R in the mean; the best triangles of that size are off by less than a third of it,
/// to both sides. The midpoints of edges stand for the whole triangle, as they give the exact mean of a quadratic
/// function over it. Vertices on the border, pinned ones, and those whose triangles would be spoiled stay. Vertices
/// along sharp edges of the shape hardly move.
void fitToSurface(RemeshedSurface& surface, Execution& execution);

} // namespace pcl::mrf

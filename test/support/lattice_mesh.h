/// \file
/// \brief Raw meshes of a field's zero level, and a plain check of meshes, independent of the library's own.
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/triangle_mesh.h>

namespace shapes {

/// Zero level of a field by marching tetrahedra: manifold, oriented outward, open where the field ends, with many
/// slivers.
pcl::mrf::TriangleMesh marchTetrahedra(const pcl::mrf::DistanceField& field);

/// What a mesh is made of, counted the slow and plain way.
struct Census {
  int vertices = 0; ///< in use
  int triangles = 0, edges = 0;
  int boundaryEdges = 0, badEdges = 0, badVertices = 0, degenerate = 0, duplicates = 0;
  double meanQuality = 0, minQuality = 0; ///< 2 inradius / circumradius
  double regularShare = 0;                ///< vertices with six edges
  double areaDeviation = 0;               ///< standard deviation / mean of the triangles' areas
  double area = 0, meanEdge = 0;

  int euler() const { return vertices - edges + triangles; }
  bool sound() const { return badEdges == 0 && badVertices == 0 && degenerate == 0 && duplicates == 0; }
};

Census takeCensus(const pcl::mrf::TriangleMesh& mesh);

} // namespace shapes

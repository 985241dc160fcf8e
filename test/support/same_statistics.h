// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Comparing what was measured of meshes.
#pragma once

#include <pcl/surface/mrf/report.h>

#include <gtest/gtest.h>

/// Expects every figure to be the same, to the last bit.
inline void expectSame(const pcl::mrf::MeshStatistics& a, const pcl::mrf::MeshStatistics& b)
{
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.edges, b.edges);
  EXPECT_EQ(a.components, b.components);
  EXPECT_EQ(a.boundaryEdges, b.boundaryEdges);
  EXPECT_EQ(a.boundaryLoops, b.boundaryLoops);
  EXPECT_EQ(a.nonManifoldEdges, b.nonManifoldEdges);
  EXPECT_EQ(a.nonManifoldVertices, b.nonManifoldVertices);
  EXPECT_EQ(a.degenerateTriangles, b.degenerateTriangles);
  EXPECT_EQ(a.unusedVertices, b.unusedVertices);
  EXPECT_EQ(a.eulerCharacteristic, b.eulerCharacteristic);
  EXPECT_EQ(a.area, b.area);
  EXPECT_EQ(a.volume, b.volume);
  EXPECT_EQ(a.meanQuality, b.meanQuality);
  EXPECT_EQ(a.minQuality, b.minQuality);
  EXPECT_EQ(a.meanEdge, b.meanEdge);
  EXPECT_EQ(a.minEdge, b.minEdge);
  EXPECT_EQ(a.maxEdge, b.maxEdge);
  EXPECT_EQ(a.areaDeviation, b.areaDeviation);
  EXPECT_EQ(a.valences, b.valences);
}

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Comparing what was measured of meshes.
#pragma once

#include <pcl/surface/mrf/report.h>

#include <gtest/gtest.h>

#include <tuple>

/// Expects every figure to be the same, to the last bit.
inline void expectSame(const pcl::mrf::MeshStatistics& a, const pcl::mrf::MeshStatistics& b)
{
  const auto figures = [](const pcl::mrf::MeshStatistics& s) {
    return std::tie(s.vertices, s.triangles, s.edges, s.components, s.boundaryEdges, s.boundaryLoops,
                    s.nonManifoldEdges, s.nonManifoldVertices, s.degenerateTriangles, s.unusedVertices,
                    s.eulerCharacteristic, s.area, s.volume, s.meanQuality, s.minQuality, s.meanEdge, s.minEdge,
                    s.maxEdge, s.areaDeviation, s.valences);
  };
  EXPECT_EQ(figures(a), figures(b));
}

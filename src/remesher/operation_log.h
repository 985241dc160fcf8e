// SPDX-License-Identifier: BSD-3-Clause
/// A log of operations on a mesh, so that those that made triangles intersect can be undone.
#pragma once

#include "remesher/half_edge_mesh.h"

#include <pcl/surface/mrf/report.h>

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Operations in order; each is added before it is done. A collapse is stored with the former position of the vertex
/// that is kept, as it may move that vertex.
class OperationLog {
public:
  void addSplit(const HalfEdgeMesh& mesh, std::int32_t h, const HalfEdgeMesh::Room& room);
  void addCollapse(const HalfEdgeMesh& mesh, std::int32_t h);
  void addFlip(const HalfEdgeMesh& mesh, std::int32_t h);

  /// The last operations on some triangles, and all later ones that depend on them.
  struct Choice {
    struct Place {
      std::size_t log, operation;
    };
    std::vector<Place> operations;       ///< in order
    std::vector<std::int32_t> triangles; ///< that these changed, removed or made
  };
  static Choice lastOn(const std::vector<std::int32_t>& triangles, const std::vector<OperationLog>& logs,
                       const HalfEdgeMesh& mesh);
  /// Undoes operations. Their triangles are then as before, unless other vertices of theirs have moved since.
  /// \param logs in the order in which they were written \param done they are subtracted from its counts
  /// \pre only operations in the logs have changed the triangles
  static void undo(const Choice& choice, std::vector<OperationLog>& logs, HalfEdgeMesh& mesh, RemeshSummary& done);

  /// Frees memory that is not in use.
  void shrink();

private:
  enum class Kind : std::uint8_t { split, collapse, flip, undone };
  struct Operation {
    Kind kind;
    std::int32_t which;      ///< half-edge; for a collapse its index in collapses_
    HalfEdgeMesh::Room room; ///< for a split only
    std::uint32_t end;       ///< end of its triangles in touched_
  };
  struct Collapse {
    HalfEdgeMesh::Collapsed edge;
    Eigen::Vector3f position, normal; ///< of the vertex that is kept, before the collapse
    float sizing;
    double place;
  };

  void add(Kind kind, std::int32_t which, const HalfEdgeMesh::Room& room = {-1, -1});
  void touchBeside(const HalfEdgeMesh& mesh, std::int32_t h);
  template <typename Body>
  void forTouched(std::size_t operation, const Body& body) const;
  void undo(std::size_t operation, HalfEdgeMesh& mesh, RemeshSummary& done);

  std::vector<Operation> operations_;
  std::vector<Collapse> collapses_;   ///< of the operations that are collapses
  std::vector<std::int32_t> touched_; ///< triangles whose corners or neighbors an operation changes
};

} // namespace pcl::mrf

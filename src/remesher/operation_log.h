// SPDX-License-Identifier: BSD-3-Clause
/// What operations did to a mesh, so that those that made triangles intersect can be undone.
#pragma once

#include "remesher/half_edge_mesh.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pcl::mrf {

/// Operations one after the other; each is added before it is done. Of a collapse it is known as well where the vertex
/// that stays was, which may move with it.
class OperationLog {
public:
  void addSplit(const HalfEdgeMesh& mesh, std::int32_t h, const HalfEdgeMesh::Room& room);
  void addCollapse(const HalfEdgeMesh& mesh, std::int32_t h);
  void addFlip(const HalfEdgeMesh& mesh, std::int32_t h);

  struct Counts {
    std::int64_t splits = 0, collapses = 0, flips = 0;
  };
  /// The last operations on some triangles, and all that stand on those.
  struct Choice {
    struct Place {
      std::size_t log, operation;
    };
    std::vector<Place> operations;       ///< in their order
    std::vector<std::int32_t> triangles; ///< that they changed, removed or made
  };
  static Choice lastOn(const std::vector<std::int32_t>& triangles, const std::vector<OperationLog>& logs,
                       const HalfEdgeMesh& mesh);
  /// Undoes operations: their triangles are as before, if no other vertex of theirs has moved since.
  /// \param logs in the order of what was done \pre nothing but operations in the logs has changed the triangles
  static Counts undo(const Choice& choice, std::vector<OperationLog>& logs, HalfEdgeMesh& mesh);

  /// Gives back memory that is not in use.
  void shrink();

private:
  enum class Kind : std::uint8_t { split, collapse, flip, undone };
  struct Operation {
    Kind kind;
    std::int32_t which;      ///< half-edge; of a collapse its number
    HalfEdgeMesh::Room room; ///< of a split
    std::uint32_t end;       ///< of the triangles in touched_
  };
  struct Collapse {
    HalfEdgeMesh::Collapsed edge;
    Eigen::Vector3f position, normal; ///< of the vertex that stays, as it was
    float sizing;
    double place;
  };

  void add(Kind kind, std::int32_t which, const HalfEdgeMesh::Room& room = {-1, -1});
  void touchBeside(const HalfEdgeMesh& mesh, std::int32_t h);
  template <typename Body>
  void forTouched(std::size_t operation, const Body& body) const;
  void undo(std::size_t operation, HalfEdgeMesh& mesh, Counts& counts);

  std::vector<Operation> operations_;
  std::vector<Collapse> collapses_;   ///< of those operations that are
  std::vector<std::int32_t> touched_; ///< triangles whose corners or neighbors an operation changes
};

} // namespace pcl::mrf

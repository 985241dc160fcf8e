// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/operation_log.h"

#include <algorithm>

namespace pcl::mrf {

/// Adds the triangles beside an edge, and those across their other sides.
void OperationLog::touchBeside(const HalfEdgeMesh& mesh, std::int32_t h)
{
  for (const std::int32_t side : {h, mesh.twin[h]})
    if (side >= 0)
      for (const std::int32_t inner : {HalfEdgeMesh::next(side), HalfEdgeMesh::previous(side)}) {
        touched_.push_back(inner / 3);
        if (mesh.twin[inner] >= 0)
          touched_.push_back(mesh.twin[inner] / 3);
      }
}

void OperationLog::add(Kind kind, std::int32_t which, const HalfEdgeMesh::Room& room)
{
  operations_.push_back({kind, which, room, static_cast<std::uint32_t>(touched_.size())});
}

void OperationLog::addSplit(const HalfEdgeMesh& mesh, std::int32_t h, const HalfEdgeMesh::Room& room)
{
  touchBeside(mesh, h);
  touched_.push_back(room.halfEdge / 3);
  touched_.push_back(room.halfEdge / 3 + 1);
  add(Kind::split, h, room);
}

void OperationLog::addCollapse(const HalfEdgeMesh& mesh, std::int32_t h)
{
  const std::int32_t kept = mesh.origin[h], gone = mesh.target(h);
  mesh.forOutgoing(kept, [&](std::int32_t spoke) { touched_.push_back(spoke / 3); });
  mesh.forOutgoing(gone, [&](std::int32_t spoke) {
    if (mesh.target(spoke) != kept && mesh.opposite(spoke) != kept)
      touched_.push_back(spoke / 3);
  });
  collapses_.push_back({mesh.collapsedBy(h), mesh.positions[kept], mesh.normals[kept], mesh.sizing[kept],
                        mesh.places.empty() ? -1 : mesh.places[kept]});
  add(Kind::collapse, static_cast<std::int32_t>(collapses_.size() - 1));
}

void OperationLog::addFlip(const HalfEdgeMesh& mesh, std::int32_t h)
{
  touchBeside(mesh, h);
  add(Kind::flip, h);
}

void OperationLog::shrink()
{
  operations_.shrink_to_fit();
  collapses_.shrink_to_fit();
  touched_.shrink_to_fit();
}

template <typename Body>
void OperationLog::forTouched(std::size_t operation, const Body& body) const
{
  if (operations_[operation].kind != Kind::undone)
    for (std::size_t n = operation > 0 ? operations_[operation - 1].end : 0; n < operations_[operation].end; ++n)
      body(touched_[n]);
}

OperationLog::Choice OperationLog::lastOn(const std::vector<std::int32_t>& triangles,
                                          const std::vector<OperationLog>& logs, const HalfEdgeMesh& mesh)
{
  enum : std::uint8_t { untouched, asked, chosen };
  std::vector<std::uint8_t> states(mesh.origin.size() / 3, untouched);
  for (const std::int32_t t : triangles)
    states[t] = asked;
  std::vector<Choice::Place> last; // latest first
  for (std::size_t log = logs.size(); log-- > 0;)
    for (std::size_t n = logs[log].operations_.size(); n-- > 0;) {
      bool isLast = false;
      logs[log].forTouched(n, [&](std::int32_t t) { isLast = isLast || states[t] == asked; });
      if (!isLast)
        continue;
      last.push_back({log, n});
      logs[log].forTouched(n, [&](std::int32_t t) { states[t] = untouched; });
    }
  Choice choice;
  if (last.empty())
    return choice;
  const Choice::Place first = last.back();
  for (std::size_t log = first.log; log < logs.size(); ++log)
    for (std::size_t n = log == first.log ? first.operation : 0; n < logs[log].operations_.size(); ++n) {
      bool isChosen = !last.empty() && last.back().log == log && last.back().operation == n;
      if (isChosen)
        last.pop_back();
      logs[log].forTouched(n, [&](std::int32_t t) { isChosen = isChosen || states[t] == chosen; });
      if (!isChosen)
        continue;
      choice.operations.push_back({log, n});
      logs[log].forTouched(n, [&](std::int32_t t) {
        states[t] = chosen;
        choice.triangles.push_back(t);
      });
    }
  return choice;
}

void OperationLog::undo(const Choice& choice, std::vector<OperationLog>& logs, HalfEdgeMesh& mesh, RemeshSummary& done)
{
  std::for_each(choice.operations.rbegin(), choice.operations.rend(),
                [&](const Choice::Place& place) { logs[place.log].undo(place.operation, mesh, done); });
}

void OperationLog::undo(std::size_t operation, HalfEdgeMesh& mesh, RemeshSummary& done)
{
  Operation& own = operations_[operation];
  switch (own.kind) {
  case Kind::split:
    mesh.undoSplit(own.which, own.room);
    --done.splits;
    break;
  case Kind::collapse: {
    const Collapse& former = collapses_[own.which];
    const std::int32_t kept = former.edge.kept;
    mesh.undoCollapse(former.edge);
    mesh.positions[kept] = former.position;
    mesh.normals[kept] = former.normal;
    mesh.sizing[kept] = former.sizing;
    if (!mesh.places.empty())
      mesh.places[kept] = former.place;
    --done.collapses;
    break;
  }
  case Kind::flip:
    for (int turn = 0; turn < 3; ++turn) // four flips turn an edge around once; the first was the operation
      mesh.flip(own.which);
    --done.flips;
    break;
  case Kind::undone:
    break;
  }
  own.kind = Kind::undone;
}

} // namespace pcl::mrf

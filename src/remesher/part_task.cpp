// SPDX-License-Identifier: BSD-3-Clause
#include "remesher/part_task.h"

#include "field/field_contents.h"
#include "remesher/zero_level.h"
#include "tiles/tasks.h"

#include <utility>

namespace pcl::mrf {
namespace {

/// Voxels of the field that a task gets around its part. The field is read near the surface, and vertices stay within
/// their part. Only steps that fail read it farther off; there it may be the background, the same for every process.
constexpr double voxelsAroundPart = 8;

Eigen::AlignedBox3d boxAround(const PartInput& part)
{
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& vertex : part.mesh.vertices)
    box.extend(vertex.cast<double>());
  const Eigen::Vector3d around = Eigen::Vector3d::Constant(voxelsAroundPart * part.field.lattice().spacing);
  return {box.min() - around, box.max() + around};
}

RemeshedPiece remesh(PartInput input, Execution& execution)
{
  return remeshPiece(input, input.plan, ZeroLevel(input.field, input.maxStep), input.options, execution);
}

} // namespace

template <typename Archive>
void serialize(Archive& archive, FieldContents& field, unsigned)
{
  serializeAll(archive, field.lattice, field.axes, field.distances, field.band, field.values, field.background);
}

template <typename Archive>
void serialize(Archive& archive, RemesherOptions& options, unsigned)
{
  serializeAll(archive, options.rounds, options.targetEdge, options.triangles, options.fit);
}

/// Only the fields that parts need.
template <typename Archive>
void serialize(Archive& archive, RemeshPlan& plan, unsigned)
{
  serializeAll(archive, plan.targetEdge, plan.maxTurn, plan.pinsFolds, plan.curves);
}

template <typename Archive>
void serialize(Archive& archive, MeshPiece& piece, unsigned)
{
  serializeAll(archive, piece.mesh.vertices, piece.mesh.triangles, piece.sizing, piece.numbers, piece.places);
}

template <typename Archive>
void serialize(Archive& archive, PartInput& part, unsigned)
{
  serializeAll(archive, static_cast<MeshPiece&>(part), part.plan, part.maxStep, part.options);
  std::vector<FieldContents> field;
  if constexpr (Archive::is_saving::value) {
    Execution serial(1);
    field = FieldContents::of(part.field, boxAround(part), serial);
  }
  serializeAll(archive, field);
  if constexpr (Archive::is_loading::value)
    part.field = FieldContents::toField(std::move(field));
}

template <typename Archive>
void serialize(Archive& archive, RemeshSummary& summary, unsigned)
{
  serializeAll(archive, summary.splits, summary.collapses, summary.flips, summary.refusedOperations,
               summary.targetEdge);
}

template <typename Archive>
void serialize(Archive& archive, RemeshedPiece& piece, unsigned)
{
  serializeAll(archive, static_cast<MeshPiece&>(piece), piece.intersecting, piece.summary);
}

void remeshEach(int count, const std::function<PartInput(int n)>& makeInput,
                const std::function<void(int n, RemeshedPiece result)>& use, Execution& execution)
{
  forTasks<PartInput, RemeshedPiece>(partKind, remesh, count, makeInput, use, execution);
}

std::string remeshPart(std::string input, Execution& execution)
{
  return doneAsBytes<PartInput, RemeshedPiece>(remesh, std::move(input), execution);
}

} // namespace pcl::mrf

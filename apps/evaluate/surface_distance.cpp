// SPDX-License-Identifier: BSD-3-Clause
#include "surface_distance.h"

#include "surface_samples.h"

#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>

#include <vtkCellArray.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStaticCellLocator.h>

#include <cmath>

namespace mrf_apps {

struct SurfaceDistance::Locator {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  std::vector<std::int32_t> triangles; ///< of the mesh, by cell
  vtkNew<vtkPolyData> data;
  vtkNew<vtkStaticCellLocator> cells;
};

SurfaceDistance::SurfaceDistance(const SurfaceMesh& mesh) : locator_(std::make_unique<Locator>())
{
  Eigen::AlignedBox3d box;
  vtkNew<vtkCellArray> polygons;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& triangle = mesh.triangles[t];
    if (!(areaVector(mesh, t).squaredNorm() > 0))
      continue;
    for (const std::int32_t v : triangle)
      box.extend(mesh.vertices[v]);
    polygons->InsertNextCell({triangle[0], triangle[1], triangle[2]});
    locator_->triangles.push_back(static_cast<std::int32_t>(t));
  }
  if (locator_->triangles.empty())
    throw pcl::mrf::InvalidInput("the mesh has no triangle with an area");
  // Far from the origin the products of the locator's arithmetic would lose digits that the differences have.
  locator_->center = box.center();

  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(mesh.vertices.size()));
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const bool usable = mesh.vertices[v].allFinite();
    const Eigen::Vector3d position =
        usable ? Eigen::Vector3d(mesh.vertices[v] - locator_->center) : Eigen::Vector3d::Zero();
    points->SetPoint(static_cast<vtkIdType>(v), position.data());
  }
  locator_->data->SetPoints(points);
  locator_->data->SetPolys(polygons);
  // Built here, because the first GetCell would build it otherwise, on several threads at once.
  locator_->data->BuildCells();
  locator_->cells->SetDataSet(locator_->data);
  locator_->cells->BuildLocator();
}

SurfaceDistance::~SurfaceDistance() = default;

std::vector<ClosestPlace> SurfaceDistance::closest(const std::vector<Eigen::Vector3d>& points,
                                                   pcl::mrf::Execution& execution) const
{
  std::vector<ClosestPlace> result(points.size());
  execution.forRange(static_cast<std::int64_t>(points.size()), 1024, [&](std::int64_t begin, std::int64_t end) {
    vtkNew<vtkGenericCell> cell;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const Eigen::Vector3d query = points[i] - locator_->center;
      Eigen::Vector3d place;
      vtkIdType id = -1;
      int part = 0;
      double squared = 0;
      locator_->cells->FindClosestPoint(query.data(), place.data(), cell, id, part, squared);
      if (id < 0)
        throw pcl::mrf::InvalidInput("no distance to the mesh could be computed");
      result[i] = {std::sqrt(squared), locator_->triangles[id]};
    }
  });
  return result;
}

std::vector<double> SurfaceDistance::distances(const std::vector<Eigen::Vector3d>& points,
                                               pcl::mrf::Execution& execution) const
{
  std::vector<double> result;
  result.reserve(points.size());
  for (const ClosestPlace& place : closest(points, execution))
    result.push_back(place.distance);
  return result;
}

} // namespace mrf_apps

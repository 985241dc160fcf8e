// SPDX-License-Identifier: BSD-3-Clause
#include "surface_distance.h"

#include "scan/random.h"
#include "support/poly_data.h"

#include <pcl/surface/mrf/exceptions.h>

#include <Eigen/Geometry>

#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkSMPTools.h>
#include <vtkStaticCellLocator.h>

#include <cmath>
#include <random>

namespace mrf_apps {

Eigen::Vector3d areaVector(const SurfaceMesh& mesh, std::size_t triangle)
{
  const auto corner = [&](std::size_t i) -> const Eigen::Vector3d& {
    return mesh.vertices[mesh.triangles[triangle][i]];
  };
  const Eigen::Vector3d result = .5 * (corner(1) - corner(0)).cross(corner(2) - corner(0));
  return result.allFinite() ? result : Eigen::Vector3d::Zero();
}

double surfaceArea(const SurfaceMesh& mesh)
{
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    area += areaVector(mesh, t).norm();
  return area;
}

struct SurfaceDistance::Locator {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  std::vector<std::int32_t> triangles; ///< of the mesh, by cell
  vtkSmartPointer<vtkPolyData> data;
  vtkNew<vtkStaticCellLocator> cells;
};

SurfaceDistance::SurfaceDistance(const SurfaceMesh& mesh) : locator_(std::make_shared<Locator>())
{
  Eigen::AlignedBox3d box;
  SurfaceMesh surface;
  surface.doublePrecision = true;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& triangle = mesh.triangles[t];
    if (!(areaVector(mesh, t).squaredNorm() > 0))
      continue;
    for (const std::int32_t v : triangle)
      box.extend(mesh.vertices[v]);
    surface.triangles.push_back(triangle);
    locator_->triangles.push_back(static_cast<std::int32_t>(t));
  }
  if (locator_->triangles.empty())
    throw pcl::mrf::InvalidInput("the mesh has no triangle with an area");
  // Centered, because the locator's products would lose digits far from the origin.
  locator_->center = box.center();
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    surface.vertices.push_back(vertex.allFinite() ? Eigen::Vector3d(vertex - box.center()) : Eigen::Vector3d::Zero());
  locator_->data = toPolyData(surface);
  // Built here, because otherwise the first GetCell builds it, on several threads at once.
  locator_->data->BuildCells();
  locator_->cells->SetDataSet(locator_->data);
  // On one thread: VTK's threads sort the triangles in another order each time, and the order decides between equally
  // near triangles.
  const vtkSMPTools::Config oneThread(std::string("Sequential"));
  vtkSMPTools::LocalScope(oneThread, [&] { locator_->cells->BuildLocator(); });
}

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

std::vector<double> distancesOf(const std::vector<ClosestPlace>& places)
{
  std::vector<double> result;
  for (const ClosestPlace& place : places)
    result.push_back(place.distance);
  return result;
}

SurfaceSamples sampleSurface(const SurfaceMesh& mesh, std::int64_t count, std::uint64_t seed)
{
  const double total = surfaceArea(mesh);
  SurfaceSamples samples;
  samples.positions.reserve(static_cast<std::size_t>(count));
  samples.triangles.reserve(static_cast<std::size_t>(count));
  std::mt19937_64 generator(seed);
  std::size_t current = 0, lastWithArea = 0;
  double before = 0; // area of the triangles before the current one
  for (std::int64_t i = 0; i < count; ++i) {
    const double target =
        total * (static_cast<double>(i) + pcl::mrf::scan::share(generator())) / static_cast<double>(count);
    for (; current < mesh.triangles.size(); ++current) {
      const double area = areaVector(mesh, current).norm();
      if (area > 0)
        lastWithArea = current;
      if (target < before + area)
        break;
      before += area;
    }
    const auto& triangle = mesh.triangles[lastWithArea];
    // The square root makes the density uniform: a line at a share r of the way to the opposite side cuts off r² of it.
    const double r = std::sqrt(pcl::mrf::scan::share(generator())), s = pcl::mrf::scan::share(generator());
    samples.positions.push_back((1 - r) * mesh.vertices[triangle[0]] + r * (1 - s) * mesh.vertices[triangle[1]] +
                                r * s * mesh.vertices[triangle[2]]);
    samples.triangles.push_back(static_cast<std::int32_t>(lastWithArea));
  }
  return samples;
}

} // namespace mrf_apps

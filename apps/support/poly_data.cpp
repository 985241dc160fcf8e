// SPDX-License-Identifier: BSD-3-Clause
#include "poly_data.h"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cstring>

namespace mrf_apps {
namespace {

vtkSmartPointer<vtkFloatArray> namedArray(const char* name, int components, std::size_t count)
{
  auto array = vtkSmartPointer<vtkFloatArray>::New();
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(count));
  return array;
}

void addScalars(const std::vector<float>& values, const char* name, vtkPointData* data)
{
  if (values.empty())
    return;
  const auto array = namedArray(name, 1, values.size());
  std::copy(values.begin(), values.end(), array->GetPointer(0));
  data->AddArray(array);
  if (data->GetScalars() == nullptr)
    data->SetActiveScalars(name);
}

} // namespace

vtkSmartPointer<vtkPolyData> toPolyData(const SurfaceMesh& mesh)
{
  auto points = vtkSmartPointer<vtkPoints>::New();
  if (mesh.doublePrecision)
    points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(mesh.vertices.size()));
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    points->SetPoint(static_cast<vtkIdType>(v), mesh.vertices[v].data());
  auto cells = vtkSmartPointer<vtkCellArray>::New();
  for (const auto& triangle : mesh.triangles)
    cells->InsertNextCell({triangle[0], triangle[1], triangle[2]});
  auto result = vtkSmartPointer<vtkPolyData>::New();
  result->SetPoints(points);
  result->SetPolys(cells);

  vtkPointData* data = result->GetPointData();
  if (!mesh.colors.empty()) {
    auto colors = vtkSmartPointer<vtkUnsignedCharArray>::New();
    colors->SetName("rgb");
    colors->SetNumberOfComponents(3);
    colors->SetNumberOfTuples(static_cast<vtkIdType>(mesh.colors.size()));
    std::memcpy(colors->GetPointer(0), mesh.colors.data(), 3 * mesh.colors.size());
    data->SetScalars(colors);
  }
  if (!mesh.normals.empty()) {
    const auto normals = namedArray("normals", 3, mesh.normals.size());
    std::memcpy(normals->GetPointer(0), mesh.normals.data(), sizeof(Eigen::Vector3f) * mesh.normals.size());
    data->SetNormals(normals);
  }
  addScalars(mesh.intensities, "intensity", data);
  addScalars(mesh.confidences, "confidence", data);
  for (const auto& [name, values] : mesh.scalars)
    addScalars(values, name.c_str(), data);
  return result;
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "poly_data.h"

#include <vtkCellArray.h>
#include <vtkFloatArray.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkUnsignedCharArray.h>

#include <cstring>

namespace mrf_apps {
namespace {

/// \param values of `components` numbers each
template <typename Array, typename Value>
vtkSmartPointer<Array> arrayOf(const char* name, int components, const std::vector<Value>& values)
{
  auto array = vtkSmartPointer<Array>::New();
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(static_cast<vtkIdType>(values.size()));
  std::memcpy(array->GetPointer(0), values.data(), sizeof(Value) * values.size());
  return array;
}

void addScalars(const std::vector<float>& values, const char* name, vtkPointData* data)
{
  if (!values.empty())
    data->AddArray(arrayOf<vtkFloatArray>(name, 1, values)); // not the active one, which viewers color the mesh by
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
  if (!mesh.colors.empty())
    data->SetScalars(arrayOf<vtkUnsignedCharArray>("rgb", 3, mesh.colors));
  if (!mesh.normals.empty())
    data->SetNormals(arrayOf<vtkFloatArray>("normals", 3, mesh.normals));
  addScalars(mesh.intensities, "intensity", data);
  addScalars(mesh.confidences, "confidence", data);
  for (const auto& [name, values] : mesh.scalars)
    addScalars(values, name.c_str(), data);
  return result;
}

} // namespace mrf_apps

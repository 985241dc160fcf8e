// SPDX-License-Identifier: BSD-3-Clause
// Writes VTK's XML formats.
#include "errors.h"
#include "poly_data.h"
#include "surface_mesh.h"
#include "text_file.h"

#include <pcl/surface/mrf/distance_field.h>

#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkXMLImageDataWriter.h>
#include <vtkXMLPolyDataWriter.h>

namespace mrf_apps {
namespace {

template <typename Writer, typename Data>
void writeXml(const Data& data, const std::string& path)
{
  auto writer = vtkSmartPointer<Writer>::New();
  writer->SetInputData(data);
  writer->WriteToOutputStringOn(); // VTK does not tell why a file cannot be written
  writer->Write();
  writeText(path, writer->GetOutputString());
}

} // namespace

void writeField(const pcl::mrf::DistanceField& field, const Eigen::Vector3d& offset, const std::string& path)
{
  const pcl::mrf::Lattice& lattice = field.lattice();
  const pcl::mrf::GridSize& size = lattice.size;
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(size.x, size.y, size.z);
  image->SetOrigin((lattice.origin + offset).eval().data());
  image->SetSpacing(lattice.spacing, lattice.spacing, lattice.spacing);

  auto distances = vtkSmartPointer<vtkFloatArray>::New();
  auto confidences = vtkSmartPointer<vtkFloatArray>::New();
  distances->SetName("distance");
  confidences->SetName("confidence");
  distances->SetNumberOfTuples(size.count());
  if (field.hasConfidences())
    confidences->SetNumberOfTuples(size.count());
  vtkIdType voxel = 0;
  for (int k = 0; k < size.z; ++k)
    for (int j = 0; j < size.y; ++j)
      for (int i = 0; i < size.x; ++i, ++voxel) {
        distances->SetValue(voxel, field.distance(i, j, k));
        if (field.hasConfidences())
          confidences->SetValue(voxel, field.confidence(i, j, k));
      }
  image->GetPointData()->SetScalars(distances);
  if (field.hasConfidences())
    image->GetPointData()->AddArray(confidences);
  writeXml<vtkXMLImageDataWriter>(image, path);
}

void writeMesh(const SurfaceMesh& mesh, const std::string& path, const std::string& format)
{
  if (writeWithoutVtk(mesh, path, format))
    return;
  if (format != "vtp")
    throw UsageError("'" + path + "': mesh files end in " + alternatives(meshFormats));
  writeXml<vtkXMLPolyDataWriter>(toPolyData(mesh), path);
}

} // namespace mrf_apps

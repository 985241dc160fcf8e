// SPDX-License-Identifier: BSD-3-Clause
#include "errors.h"
#include "poly_data.h"
#include "surface_mesh.h"
#include "text_file.h"

#include <vtkXMLPolyDataWriter.h>

namespace mrf_apps {

void writeMesh(const SurfaceMesh& mesh, const std::string& path, const std::string& format)
{
  if (writeWithoutVtk(mesh, path, format))
    return;
  if (format != "vtp")
    throw UsageError("'" + path + "': mesh files end in " + meshFileExtensions);
  auto writer = vtkSmartPointer<vtkXMLPolyDataWriter>::New();
  writer->SetInputData(toPolyData(mesh));
  writer->WriteToOutputStringOn(); // VTK would not tell why a file cannot be written
  writer->Write();
  writeText(path, writer->GetOutputString());
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// Converts meshes to VTK.
#pragma once

#include "surface_mesh.h"

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

namespace mrf_apps {

/// Colors, if there are any, are the active scalars; intensities, confidences and all other fields are named arrays.
vtkSmartPointer<vtkPolyData> toPolyData(const SurfaceMesh& mesh);

} // namespace mrf_apps

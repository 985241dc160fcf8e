// SPDX-License-Identifier: BSD-3-Clause
/// A mesh as VTK sees it.
#pragma once

#include "surface_mesh.h"

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

namespace mrf_apps {

/// Colors are the scalars where the mesh has them, else intensities, else confidences; all other fields are named
/// arrays.
vtkSmartPointer<vtkPolyData> toPolyData(const SurfaceMesh& mesh);

} // namespace mrf_apps

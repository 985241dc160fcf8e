// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The mesh beside the true surface, as the sensors see both.
#pragma once

#include "evaluation.h"

namespace mrf_apps {

/// By rays from the sensors to samples of what they see of the reference, and to samples of the mesh.
/// \param measured points of the reference: what is farther from them than SensorComparison::scannedLimit of their
/// spacings was not looked at; empty: all was that can be seen \param options with sensors, and no automatic values
/// left \throw pcl::mrf::InvalidInput if no sensor sees any of the reference Cost: three rays per sample and sensor.
/// The result does not depend on the number of threads.
SensorComparison compareFromSensors(const SurfaceMesh& mesh, const SurfaceMesh& reference,
                                    const std::vector<Eigen::Vector3d>& measured, const EvaluationOptions& options,
                                    pcl::mrf::Execution& execution);

} // namespace mrf_apps

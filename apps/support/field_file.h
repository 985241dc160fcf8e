// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The distance field as a VTK image.
#pragma once

#include <pcl/surface/mrf/distance_field.h>

#include <Eigen/Core>

#include <string>

namespace mrf_apps {

/// Writes a VTI file with the point arrays `distance` and `confidence`.
/// \param offset of the field's frame in the cloud's; becomes part of the image's origin
/// \throw pcl::mrf::FileError
void writeField(const pcl::mrf::DistanceField& field, const Eigen::Vector3d& offset, const std::string& path);

} // namespace mrf_apps

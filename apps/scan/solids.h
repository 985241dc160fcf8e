// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Solids that shapes and scenes are made of.
#pragma once

#include "analytic_surface.h"

#include <vector>

namespace pcl::mrf::scan {

/// The box of these half sides about a center.
Box boxOf(const Eigen::Vector3d& half, const Eigen::Vector3d& center = Eigen::Vector3d::Zero());

/// \param rounding of the edges, at most the shortest half side
Shape makeBox(const Eigen::Vector3d& half, double rounding, const Eigen::Vector3d& center = Eigen::Vector3d::Zero());

Shape makeSphere(double radius, const Eigen::Vector3d& center = Eigen::Vector3d::Zero());

/// Around an axis parallel to z.
Shape makeTorus(double majorRadius, double minorRadius, const Eigen::Vector3d& center = Eigen::Vector3d::Zero());

/// Along one of the axes. \param areEndsClosed false: its ends belong to the solid, but are not seen
Shape makeCylinder(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius, bool areEndsClosed);

/// All of them: what is buried in another is not surface. \pre none has openings
Shape unite(const std::vector<Shape>& parts);

} // namespace pcl::mrf::scan

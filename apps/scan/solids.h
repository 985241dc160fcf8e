// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Solids that shapes and scenes are made of, and the scenes.
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

// Scenes like those that depth cameras, lidars and airborne scanners see: open, cluttered, of uneven density.

/// Objects on a table before a wall, y up, the table's top at y = 0, the wall at −z. \param size of the whole over 2.8
/// m
Shape makeTableScene(double size);

/// The inside of a room, y up, the floor at y = 0 about the origin: table, chair, sofa, shelf, lamp and small things.
/// \param width along x; 4/5 of it deep and 1/2 high
Shape makeRoom(double width);

/// Somebody who stands on the origin, y up, with arms apart, facing +z. \param height over 1.75 m
Shape makePerson(double height);

/// The front of a house, y up, seen from +z: windows, door, ledges, columns, a balcony. \param width along x
Shape makeFacade(double width);

/// Hills with trees (spheres) and houses (boxes) on a square about the origin, z up, open at its border. The distance
/// is a lower bound above the ground. \param side of the square, > 0 \param steepest bound of the slope, 0 to 10
Shape makeTerrain(double side, double steepest, int trees, int houses);

/// A street along x between houses with gaps, cars and posts; z up, the ground at z = 0, its middle at the origin.
/// \param length of the street, in a frame in which it is 16 wide
Shape makeStreet(double length);

} // namespace pcl::mrf::scan

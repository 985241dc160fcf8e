// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Scenes like those that depth cameras, lidars and airborne scanners see: open, cluttered, of uneven density.
#pragma once

#include "analytic_surface.h"

namespace pcl::mrf::scan {

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

struct TerrainOptions {
  double side = 100;   ///< of the square, > 0
  double steepest = 1; ///< bound of the slope, 0 to 10
  int trees = 60, houses = 12;
};

/// Hills with trees (spheres) and houses (boxes) on a square about the origin, z up, open at its border. The distance
/// is a lower bound above the ground.
Shape makeTerrain(const TerrainOptions& options);

/// A street along x between houses with gaps, cars and posts; z up, the ground at z = 0, its middle at the origin.
/// \param length of the street, in a frame in which it is 16 wide
Shape makeStreet(double length);

} // namespace pcl::mrf::scan

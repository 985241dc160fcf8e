// SPDX-License-Identifier: BSD-3-Clause
/// Analytic shapes as surfaces to scan: patches, solids, scenes, and the catalog of named shapes.
#pragma once

#include "surface.h"

#include <functional>
#include <string>
#include <vector>

namespace pcl::mrf::scan {

/// A piece of surface with a closed parametrization.
struct Patch {
  double area = 0; ///< over which draws are spread, rejected ones too
  /// Sets position and normal. \return false to reject the draw
  std::function<bool(const Draw& draw, SurfacePoint& point)> at;
};

/// The part of a sphere with z ≥ center.z + lowest · radius.
Patch spherePatch(double radius, const Eigen::Vector3d& center, double lowest = -1);
Patch torusPatch(double majorRadius, double minorRadius, const Eigen::Vector3d& center);
/// The side of a cylinder from a to b, without its ends.
Patch cylinderPatch(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius);
Patch discPatch(const Eigen::Vector3d& center, const Eigen::Vector3d& normal, double radius);
/// corner + s·side1 + t·side2 with perpendicular sides; the normal is side1 × side2.
Patch rectanglePatch(const Eigen::Vector3d& corner, const Eigen::Vector3d& side1, const Eigen::Vector3d& side2);
/// The same patch, seen from the other side: the wall of a cavity.
Patch reversed(const Patch& patch);

/// A shape given by its signed distance and by patches that cover its zero level: a point of a patch is on the surface
/// only where the distance is 0. So solids are joined and cut by their distances alone, and sampling stays even.
struct Shape {
  shapes::Sdf distance;
  std::vector<Patch> patches;
  Box box;
  /// True at places of the zero level inside the box that no patch covers: openings. Empty: there are none.
  std::function<bool(const Eigen::Vector3d& position)> isOpen = {};
};

class AnalyticSurface : public Surface {
public:
  explicit AnalyticSurface(Shape shape);

  /// Accurate to 10⁻⁴ of the diagonal; where patches end in each other and at openings to 5 · 10⁻⁴, and details
  /// narrower than half a per cent may be missed there. Cells of two triangles share no vertices.
  Triangles triangulate() const override;
  double drawnArea() const override { return areas_.back(); }
  bool sample(const Draw& draw, SurfacePoint& point) const override;
  /// By sphere tracing.
  bool isOccluded(const SurfacePoint& point, const Eigen::Vector3d& from) const override;
  /// By sphere tracing, to 10⁻⁹ of the diagonal; the normal by differences of the distance. At an opening the ray ends
  /// without a hit, because the zero level there hides what is behind it.
  bool firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, SurfacePoint& point) const override;
  Box boundingBox() const override { return shape_.box; }
  const shapes::Sdf& distance() const { return shape_.distance; }

private:
  Shape shape_;
  std::vector<double> areas_; ///< cumulative
};

/// The box with these half sides around a center.
Box boxOf(const Eigen::Vector3d& half, const Eigen::Vector3d& center = Eigen::Vector3d::Zero());

/// \param rounding of the edges, at most the shortest half side
Shape makeBox(const Eigen::Vector3d& half, double rounding, const Eigen::Vector3d& center = Eigen::Vector3d::Zero());

Shape makeSphere(double radius, const Eigen::Vector3d& center = Eigen::Vector3d::Zero());

/// Around an axis parallel to z.
Shape makeTorus(double majorRadius, double minorRadius, const Eigen::Vector3d& center = Eigen::Vector3d::Zero());

/// Along one of the axes. \param areEndsClosed false: the ends belong to the solid, but are not surface
Shape makeCylinder(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius, bool areEndsClosed);

/// The union of the parts; surface of a part inside another part is dropped. \pre no part has openings
Shape unite(const std::vector<Shape>& parts);

// Scenes like those that depth cameras, lidars and airborne scanners see: open, cluttered, of uneven density.

/// Objects on a table before a wall, y up, the table's top at y = 0, the wall at −z. \param size width of the wall
Shape makeTableScene(double size);

/// The inside of a room, y up, the floor at y = 0 about the origin: table, chair, sofa, shelf, lamp and small things.
/// \param width along x; the depth is 4/5 of it, the height 1/2
Shape makeRoom(double width);

/// A person standing on the origin, y up, with arms apart, facing +z. \param height of the person
Shape makePerson(double height);

/// The front of a house, y up, seen from +z: windows, door, ledges, columns, a balcony. \param width along x
Shape makeFacade(double width);

/// Hills with trees (spheres) and houses (boxes) on a square about the origin, z up, open at its border. The distance
/// is a lower bound above the ground. \param side of the square, > 0 \param steepest bound of the slope, 0 to 10
Shape makeTerrain(double side, double steepest, int trees, int houses);

/// A street along x between houses with gaps, cars and posts; z up, the ground at z = 0, its middle at the origin.
/// \param length of the street, in a frame in which it is 16 wide
Shape makeStreet(double length);

/// A shape from its description, "name" or "name:parameter=value,...", for example "torus:major=2,minor=.5".
/// \throw InvalidOption naming the unknown name or parameter, or the value that is out of range
Shape makeShape(const std::string& description);

/// True if the text starts with the name of a shape (followed by nothing or a colon).
bool isShape(const std::string& description);

/// One line per shape: name, parameters with their defaults, meaning. For the tool's help.
std::string describeShapes();

} // namespace pcl::mrf::scan

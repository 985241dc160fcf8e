// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/given_signs.h"

#include "base/select_values.h"
#include "orientation/orientation.h"
#include "points/sensor_view.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace pcl::mrf {
namespace {

/// Share of opposed neighbors above which signs are random. A lidar's street has .11, fifteen other scans up to .01.
constexpr double opposedAtRandom = .25;

/// Share of opposed neighbors above which the signs of a closed surface change along a line. A line around a quarter of
/// a ball has .9 / √n. Where two balls touch, only a few points are opposed.
double opposedSomewhere(std::size_t points)
{
  return std::max(.002, .5 / std::sqrt(static_cast<double>(points)));
}

/// Shares of normals that look into the volume that a surface encloses: up to mayLookInside is fine, and above
/// allLookInside all normals are taken to look inward.
constexpr double mayLookInside = .1, allLookInside = .75;

/// Max share of hidden points of an object that was seen from outside. A hidden point sees out in no direction.
constexpr double mayBeHidden = .03;

/// Whether a point's normal is the cloud's own.
bool isGiven(const PreparedPoints& prepared, std::size_t i)
{
  return prepared.points.normals.empty() || !prepared.points.normals[i].isZero();
}

/// Share of the pairs of neighbors on smooth surface whose normals point to opposite sides.
double opposedShare(const PreparedPoints& prepared, const std::vector<Eigen::Vector3f>& normals,
                    const NeighborSearch& search)
{
  constexpr std::size_t most = 4096;
  constexpr int neighbors = 5;
  constexpr float smooth = .9f; // cosine, of either sign
  // Max height of a neighbor, as a share of its distance: a higher one may be on the other side of a thin object.
  constexpr float across = .3f;
  const PointSet& points = prepared.points;
  const std::size_t asked = std::min(points.size(), most);
  double pairs = 0, opposed = 0;
  Neighbors nearest;
  for (std::size_t n = 0; n < asked; ++n) {
    const std::size_t i = n * points.size() / asked;
    search.nearest(points.positions[i], neighbors, nearest);
    for (const std::size_t other : nearest.indices) {
      const float cosine = normals[i].dot(normals[other]);
      const Eigen::Vector3f edge = points.positions[other] - points.positions[i];
      const float height = std::max(std::abs(edge.dot(normals[i])), std::abs(edge.dot(normals[other])));
      if (other == i || !(std::abs(cosine) > smooth) || !(height <= across * edge.norm()) || !isGiven(prepared, i) ||
          !isGiven(prepared, other))
        continue;
      ++pairs;
      opposed += cosine < 0 ? 1 : 0;
    }
  }
  return pairs > 0 ? opposed / pairs : 0;
}

/// Whether the normals, weighted by the areas around their points, look away from the middle of all points.
bool looksOutward(const PointSet& points, const std::vector<Eigen::Vector3f>& normals)
{
  Eigen::Vector4d moment = Eigen::Vector4d::Zero();
  const auto areaOf = [&](std::size_t i) {
    return points.spacings.empty() ? 1 : double{points.spacings[i]} * points.spacings[i];
  };
  for (std::size_t i = 0; i < points.size(); ++i)
    moment += areaOf(i) * points.positions[i].cast<double>().homogeneous();
  double flux = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    flux += areaOf(i) * normals[i].cast<double>().dot(points.positions[i].cast<double>() - moment.hnormalized());
  return flux >= 0;
}

/// The share of the normals that look into the volume that the points enclose; 0 if they enclose none, or if turning
/// them outward leaves more than half as many opposed neighbors, as in foliage. \param opposed see opposedShare
double inwardShare(const PreparedPoints& prepared, const NeighborSearch& search, double opposed, const Options& options,
                   const Report& report, Execution& execution)
{
  const OrientationResult outward = orientNormals(prepared.points, prepared.normals, search, report.density,
                                                  OrientationVote::outward, options.orientation, execution);
  if (outward.sideIsGuessed ||
      opposedShare(prepared, outward.normals, search) > std::max(opposedSomewhere(prepared.points.size()), opposed / 2))
    return 0;
  double inward = 0, given = 0;
  for (std::size_t i = 0; i < prepared.normals.size(); ++i)
    if (isGiven(prepared, i)) {
      ++given;
      inward += prepared.normals[i].dot(outward.normals[i]) < 0;
    }
  return inward / given;
}

/// Whether a ray from a point leaves the cloud's box without coming close to a point.
bool seesOut(const PointSet& points, const NeighborSearch& search, const BoundingBox& box, std::size_t from,
             const Eigen::Vector3f& direction, Neighbors& nearest)
{
  constexpr float thickness = 2.5f, start = 5, minStep = .5f; // in local spacings
  const float spacing = points.spacings[from];
  for (float distance = start * spacing;;) {
    const Eigen::Vector3f at = points.positions[from] + distance * direction;
    if ((at - box.lower).minCoeff() <= 0 || (box.upper - at).minCoeff() <= 0)
      return true;
    if (search.nearest(at, 1, nearest) < 1)
      return true;
    const float free =
        std::sqrt(nearest.squaredDistances.front()) - thickness * points.spacings[nearest.indices.front()];
    if (free <= 0)
      return false;
    distance += std::max(free, minStep * spacing);
  }
}

/// The share of the points that cannot be seen from outside if all normals are turned around.
double hiddenBehind(const PreparedPoints& prepared, const NeighborSearch& search)
{
  constexpr std::size_t most = 512;
  constexpr int rings = 4, perRing = 12;
  constexpr float tilt = .25f; // radians from ring to ring
  const PointSet& points = prepared.points;
  const BoundingBox box = boundingBox(points.positions);
  const std::size_t asked = points.spacings.empty() ? 0 : std::min(points.size(), most);
  std::size_t hidden = 0;
  Neighbors nearest;
  for (std::size_t n = 0; n < asked; ++n) {
    const std::size_t i = n * points.size() / asked;
    const Eigen::Vector3f axis = -prepared.normals[i], across = axis.unitOrthogonal(), third = axis.cross(across);
    bool isOut = axis.isZero() || seesOut(points, search, box, i, axis, nearest);
    for (int k = 0; k < rings * perRing && !isOut; ++k) {
      const float angle = tilt * static_cast<float>(1 + k / perRing),
                  turn = 2 * static_cast<float>(EIGEN_PI) * static_cast<float>(k) / perRing;
      isOut = seesOut(points, search, box, i,
                      std::cos(angle) * axis + std::sin(angle) * (std::cos(turn) * across + std::sin(turn) * third),
                      nearest);
    }
    hidden += isOut ? 0 : 1;
  }
  return asked > 0 ? static_cast<double>(hidden) / static_cast<double>(asked) : 0;
}

} // namespace

bool isSeenFromOrigin(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals,
                      const Eigen::Vector3d& offset, Execution& execution)
{
  constexpr std::int64_t oneIn = 1000; // normal may look past the origin
  const Eigen::Vector3f origin = (-offset).cast<float>();
  const BoundingBox box = boundingBox(positions);
  if ((origin - (box.lower + box.upper) / 2).norm() > maxDiagonals * box.diagonal())
    return false;
  std::vector<std::uint8_t> looksThere(positions.size(), 1);
  const std::int64_t others = dropWhere(
      looksThere, [&](std::size_t i) { return normals[i].dot(origin - positions[i]) <= 0; }, execution);
  return others * oneIn <= static_cast<std::int64_t>(positions.size());
}

bool areSignsWrong(const PreparedPoints& prepared, const NeighborSearch& search, const Options& options, Report& report,
                   Execution& execution)
{
  const PointSet& points = prepared.points;
  const double opposed = opposedShare(prepared, prepared.normals, search);
  std::ostringstream text;
  if (opposed > opposedAtRandom) {
    text << std::lround(100 * opposed) << " % of the normals point to the other side than their neighbors'";
  } else {
    if (!points.sensors.empty())
      return false;
    const bool isFromOrigin = isSeenFromOrigin(points.positions, prepared.normals, points.offset, execution);
    const bool isConsistent = opposed <= opposedSomewhere(points.size());
    if (isConsistent && !isFromOrigin && looksOutward(points, prepared.normals))
      return false;
    const BoundingBox box = boundingBox(points.positions);
    const Eigen::Array3f origin = (-points.offset).cast<float>();
    if (isConsistent && isFromOrigin && (origin > box.lower.array()).all() && (origin < box.upper.array()).all())
      return false;
    const double inward = inwardShare(prepared, search, opposed, options, report, execution);
    // The normals of rooms look inward as well. A sensor outside would not have seen the objects in a room.
    const bool isAll = !isFromOrigin && inward > allLookInside;
    if (inward <= mayLookInside || (isAll && hiddenBehind(prepared, search) > mayBeHidden))
      return false;
    text << std::lround(100 * inward) << " % of the normals look into what the points enclose"
         << (isFromOrigin ? ", all at the origin as if a sensor had been there" : "");
  }
  text << ": all were turned anew; normals.source = use keeps them";
  report.warnings.push_back(text.str());
  return true;
}

} // namespace pcl::mrf

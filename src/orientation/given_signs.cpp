// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/given_signs.h"

#include "base/select_values.h"
#include "orientation/orientation.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace pcl::mrf {
namespace {

/// Of smooth neighbors that are opposed: .11 on a street seen by a lidar, up to .01 on fifteen other scans.
constexpr double opposedAtRandom = .25;

/// As many are where the signs of a closed surface change somewhere.
constexpr double opposedSomewhere = .002;

/// Of a surface that encloses a volume, the share of normals that may look into it.
constexpr double mayLookInside = .1;

/// Whether a point's normal is the cloud's own.
bool isGiven(const PreparedPoints& prepared, std::size_t i)
{
  return prepared.points.normals.empty() || !prepared.points.normals[i].isZero();
}

/// Of points and their neighbors on smooth surface, the share whose normals point to opposite sides.
double opposedShare(const PreparedPoints& prepared, const std::vector<Eigen::Vector3f>& normals,
                    const NeighborSearch& search)
{
  constexpr std::size_t most = 4096;
  constexpr int neighbors = 5;
  constexpr float smooth = .9f; // cosine, of either sign
  const PointSet& points = prepared.points;
  const std::size_t asked = std::min(points.size(), most);
  double pairs = 0, opposed = 0;
  Neighbors nearest;
  for (std::size_t n = 0; n < asked; ++n) {
    const std::size_t i = n * points.size() / asked;
    search.nearest(points.positions[i], neighbors, nearest);
    for (const std::size_t other : nearest.indices) {
      const float cosine = normals[i].dot(normals[other]);
      if (other == i || !(std::abs(cosine) > smooth) || !isGiven(prepared, i) || !isGiven(prepared, other))
        continue;
      ++pairs;
      opposed += cosine < 0 ? 1 : 0;
    }
  }
  return pairs > 0 ? opposed / pairs : 0;
}

/// Whether the normals, each weighing as the area around its point, look away from the middle of all points.
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

/// The share of the normals that look into what the points enclose; 0 if they enclose nothing, or what is outside is
/// less clear than the given signs are, as in foliage. \param opposed see opposedShare
double inwardShare(const PreparedPoints& prepared, const NeighborSearch& search, double opposed, const Options& options,
                   const Report& report, Execution& execution)
{
  const OrientationResult outward = orientNormals(prepared.points, prepared.normals, search, report.density,
                                                  OrientationVote::outward, options.orientation, execution);
  if (outward.sideIsGuessed ||
      opposedShare(prepared, outward.normals, search) > std::max(opposedSomewhere, opposed / 2))
    return 0;
  double inward = 0, given = 0;
  for (std::size_t i = 0; i < prepared.normals.size(); ++i)
    if (isGiven(prepared, i)) {
      ++given;
      inward += prepared.normals[i].dot(outward.normals[i]) < 0;
    }
  return inward / given;
}

} // namespace

bool isSeenFromOrigin(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals,
                      const Eigen::Vector3d& offset, Execution& execution)
{
  constexpr std::int64_t oneIn = 1000; // may look past it
  constexpr float maxDiagonals = 100;  // of the cloud, away from it
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
    const bool isConsistent = opposed <= opposedSomewhere;
    if (isConsistent && !isFromOrigin && looksOutward(points, prepared.normals))
      return false;
    const BoundingBox box = boundingBox(points.positions);
    const Eigen::Array3f origin = (-points.offset).cast<float>();
    if (isConsistent && isFromOrigin && (origin > box.lower.array()).all() && (origin < box.upper.array()).all())
      return false;
    const double inward = inwardShare(prepared, search, opposed, options, report, execution);
    if (inward <= mayLookInside)
      return false;
    text << std::lround(100 * inward) << " % of the normals look into what the points enclose"
         << (isFromOrigin ? ", all at the origin as if a sensor had been there" : "");
  }
  text << ": all were turned anew; normals.source = use keeps them";
  report.warnings.push_back(text.str());
  return true;
}

} // namespace pcl::mrf

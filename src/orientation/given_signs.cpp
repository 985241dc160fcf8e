// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/given_signs.h"

#include "base/select_values.h"
#include "orientation/orientation.h"
#include "orientation/orientation_sides.h"
#include "points/sensor_view.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

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

/// Max share of normals that point to the wrong side by chance, and by errors of the test. Above allLookInside all
/// normals are taken to look into the volume that the surface encloses.
constexpr double mayDisagree = .1, allLookInside = .75;

/// Max share of the points of smooth pieces whose signs differ where thin walls or creases join pieces wrongly.
constexpr double mayJoin = .05;

/// The same if all normals point to one side of an axis.
constexpr double mayStray = .002;

/// Max share of hidden points of an object that was seen from outside.
constexpr double mayBeHidden = .02;

/// Sparsity of hidden points above which few rays from outside reached them, as in a bore. What stands in a room is
/// hidden from outside, but not much sparser than the walls.
constexpr double sparse = .86;

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
  double pairs = 0, opposed = 0;
  Neighbors nearest;
  for (const std::size_t i : spreadIndices(points.size(), most)) {
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
  std::vector<float> areas(points.size(), 1);
  for (std::size_t i = 0; i < points.spacings.size(); ++i)
    areas[i] = points.spacings[i] * points.spacings[i];
  const auto forPoints = [&](const auto& visit) {
    for (std::size_t i = 0; i < points.size(); ++i)
      visit(i);
  };
  return outwardness(points.positions, areas, forPoints, [&](std::size_t i) { return normals[i]; }) >= 0;
}

/// The share of the given normals that point to the other side than these do.
double disagreeingShare(const PreparedPoints& prepared, const std::vector<Eigen::Vector3f>& normals)
{
  double disagreeing = 0, given = 0;
  for (std::size_t i = 0; i < prepared.normals.size(); ++i)
    if (isGiven(prepared, i)) {
      ++given;
      disagreeing += prepared.normals[i].dot(normals[i]) < 0;
    }
  return disagreeing / given;
}

/// How many times farther apart the sparsest points are than the densest, leaving out a twentieth at either end.
/// \param lengthOf the length of point i that spacings are compared to
template <typename LengthOf>
float unevenness(const PointSet& points, const LengthOf& lengthOf)
{
  constexpr std::size_t most = 4096;
  std::vector<float> spacings;
  for (const std::size_t i : spreadIndices(points.spacings.size(), most))
    spacings.push_back(points.spacings[i] / std::max(lengthOf(i), std::numeric_limits<float>::min()));
  return !spacings.empty() ? quantile(spacings, .95) / quantile(spacings, .05) : 1;
}

/// Whether the spacings are rather those of a scan from the origin, in proportion to the range.
bool isSampledFromOrigin(const PointSet& points)
{
  constexpr float slack = 1.1f; // where all ranges are about equal
  const Eigen::Vector3f origin = (-points.offset).cast<float>();
  const auto rangeOf = [&](std::size_t i) { return (points.positions[i] - origin).norm(); };
  return unevenness(points, rangeOf) <= slack * unevenness(points, [](std::size_t) { return 1.f; });
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

/// Points that are hardly seen from outside.
struct Hidden {
  double share = 0;    ///< of all points
  double sparsity = 0; ///< share of all points that are denser than the median of these

  /// Whether they tell of a scan from outside.
  bool areHardlyReached() const { return share > mayBeHidden && sparsity > sparse; }
};

/// The points that are hardly seen from outside on the side of their normals times this sign.
Hidden hiddenOnSide(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, float sign,
                    const NeighborSearch& search)
{
  constexpr std::size_t most = 512;
  constexpr int rings = 4, perRing = 12;
  constexpr float tilt = .25f; // radians from ring to ring
  constexpr int few = 5;       // directions: a point is seen in more of them
  const BoundingBox box = boundingBox(points.positions);
  std::vector<float> hidden, all; // spacings
  Neighbors nearest;
  for (const std::size_t i : spreadIndices(points.spacings.size(), most)) {
    const Eigen::Vector3f axis = sign * normals[i], across = axis.unitOrthogonal(), third = axis.cross(across);
    if (axis.isZero())
      continue;
    int out = seesOut(points, search, box, i, axis, nearest) ? 1 : 0;
    for (int k = 0; k < rings * perRing && out <= few; ++k) {
      const float angle = tilt * static_cast<float>(1 + k / perRing),
                  turn = 2 * static_cast<float>(EIGEN_PI) * static_cast<float>(k) / perRing;
      out += seesOut(points, search, box, i,
                     std::cos(angle) * axis + std::sin(angle) * (std::cos(turn) * across + std::sin(turn) * third),
                     nearest);
    }
    all.push_back(points.spacings[i]);
    if (out <= few)
      hidden.push_back(points.spacings[i]);
  }
  if (hidden.empty())
    return {};
  const auto denser =
      std::count_if(all.begin(), all.end(), [limit = median(hidden)](float spacing) { return spacing < limit; });
  const auto total = static_cast<double>(all.size());
  return {static_cast<double>(hidden.size()) / total, static_cast<double>(denser) / total};
}

/// The place that nearly all given normals look at, as those do that were turned to a viewpoint; none if there is no
/// such place. Of all places it has the least sum of squares of the distances by which points look past it, which is
/// convex: Newton steps find it.
std::optional<Eigen::Vector3f> placeLookedAt(const PreparedPoints& prepared)
{
  constexpr std::size_t most = 4096;
  constexpr double nearlyAll = .995;
  constexpr int maxSteps = 50;
  const PointSet& points = prepared.points;
  const std::vector<std::uint32_t> asked = spreadIndices(points.size(), most);
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (int step = 0; step < maxSteps; ++step) {
    Eigen::Matrix3d matrix = std::numeric_limits<float>::epsilon() * Eigen::Matrix3d::Identity();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double given = 0, past = 0;
    for (const std::size_t i : asked) {
      const Eigen::Vector3d normal = prepared.normals[i].cast<double>();
      const double distance = normal.dot(points.positions[i].cast<double>() - place);
      given += isGiven(prepared, i) ? 1 : 0;
      if (!isGiven(prepared, i) || distance <= 0)
        continue;
      ++past;
      matrix += normal * normal.transpose();
      right += distance * normal;
    }
    if (past <= (1 - nearlyAll) * given)
      return place.cast<float>();
    place += matrix.ldlt().solve(right);
  }
  return {};
}

/// Whether the given normals were turned to one side of an axis, as by filters that let them point up: none points to
/// the other side, and some are so steep that noise would turn half of them there.
bool areTurnedAlongAxis(const PreparedPoints& prepared)
{
  constexpr float steep = .1f;               // sine of the angle to the axis' plane
  constexpr double some = .01, beyond = .02; // share of the steep ones, of all; of those that point to the other side
  struct Side {
    Eigen::Array3d all = Eigen::Array3d::Zero(), steep = Eigen::Array3d::Zero(); // by axis
  } upper, lower;
  double given = 0;
  for (std::size_t i = 0; i < prepared.normals.size(); ++i)
    if (isGiven(prepared, i)) {
      const Eigen::Array3f along = prepared.normals[i].array();
      const auto isSteep = along.abs() < steep;
      ++given;
      upper.all += (along > 0).cast<double>();
      lower.all += (along < 0).cast<double>();
      upper.steep += (along > 0 && isSteep).cast<double>();
      lower.steep += (along < 0 && isSteep).cast<double>();
    }
  const Eigen::Array3d fewer = upper.all.min(lower.all),
                       steepOnes = (upper.all > lower.all).select(upper.steep, lower.steep);
  return (fewer < beyond * steepOnes && steepOnes > some * given).any();
}

/// Whether other points hide many of the points from the place that all normals look at: a sensor there has not seen
/// them, and did not tell the side of their normals.
bool lookAtWhatHardlySeesThem(const PreparedPoints& prepared, Execution& execution)
{
  constexpr double many = .05;
  const std::optional<Eigen::Vector3f> place = placeLookedAt(prepared);
  if (!place || prepared.points.spacings.empty())
    return false;
  PointArrays seen = prepared.points;
  seen.sensors = {*place};
  return hiddenShare(seen, prepared.points.spacings, execution) > many;
}

/// The share of the normals whose sign is unlike that of most others of the same smooth piece of surface.
double minorityOfPieces(const PreparedPoints& prepared, const NeighborSearch& search, const Options& options,
                        const Report& report, Execution& execution)
{
  OrientationOptions withoutCreases = options.orientation;
  withoutCreases.joinAcrossCreases = false;
  return orientNormals(prepared.points, prepared.normals, search, report.density, OrientationVote::outward,
                       withoutCreases, execution)
      .minorityShare;
}

} // namespace

bool isUneven(const PointSet& points)
{
  constexpr float even = 2.1f;
  return unevenness(points, [](std::size_t) { return 1.f; }) > even;
}

double hiddenOutside(const PointSet& points, const std::vector<Eigen::Vector3f>& normals, const NeighborSearch& search)
{
  constexpr double few = .04;
  const Hidden outside = isUneven(points) ? hiddenOnSide(points, normals, 1, search) : Hidden();
  const bool isRoom = outside.share > few && !outside.areHardlyReached() &&
                      hiddenOnSide(points, normals, -1, search).share > outside.share;
  return isRoom ? outside.share : 0;
}

bool isSeenFromOrigin(const std::vector<Eigen::Vector3f>& positions, const std::vector<Eigen::Vector3f>& normals,
                      const Eigen::Vector3d& offset, Execution& execution)
{
  constexpr std::int64_t oneIn = 1000; // normal may look past the origin
  constexpr float grazing = .01f;      // cosine of a normal that looks neither there nor past it
  const Eigen::Vector3f origin = (-offset).cast<float>();
  const BoundingBox box = boundingBox(positions);
  if ((origin - (box.lower + box.upper) / 2).norm() > maxDiagonals * box.diagonal())
    return false;
  std::vector<std::uint8_t> looksThere(positions.size(), 1);
  const std::int64_t others = dropWhere(
      looksThere,
      [&](std::size_t i) {
        const Eigen::Vector3f sight = origin - positions[i];
        return normals[i].dot(sight) <= -grazing * sight.norm();
      },
      execution);
  return others * oneIn <= static_cast<std::int64_t>(positions.size());
}

GivenSigns judgeSigns(const PreparedPoints& prepared, const NeighborSearch& search, const Options& options,
                      Report& report, Execution& execution)
{
  const PointSet& points = prepared.points;
  const auto areWrong = [&](double share, const std::string& what) {
    report.warnings.push_back((share < .01 ? "less than 1" : std::to_string(std::lround(100 * share))) +
                              " % of the normals " + what + ": all were turned anew; normals.source = use keeps them");
    return GivenSigns::wrong;
  };
  const double opposed = opposedShare(prepared, prepared.normals, search);
  if (opposed > opposedAtRandom)
    return areWrong(opposed, "point to the other side than their neighbors'");
  if (!points.sensors.empty())
    return GivenSigns::right;
  const bool isConsistent = opposed <= opposedSomewhere(points.size());
  const bool isFromOrigin = isSeenFromOrigin(points.positions, prepared.normals, points.offset, execution);
  if (isConsistent && (isFromOrigin ? isSampledFromOrigin(points) : looksOutward(points, prepared.normals)))
    return GivenSigns::right;
  const OrientationResult outward = orientNormals(points, prepared.normals, search, report.density,
                                                  OrientationVote::outward, options.orientation, execution);
  if (opposedShare(prepared, outward.normals, search) > std::max(opposedSomewhere(points.size()), opposed / 2))
    return GivenSigns::right; // as in foliage: nothing better is known
  const std::string toOrigin = isFromOrigin ? ", all at the origin as if a sensor had been there" : "";
  const double inward = disagreeingShare(prepared, outward.normals);
  if (outward.sideIsGuessed || isUneven(points)) {
    const double minority = minorityOfPieces(prepared, search, options, report, execution);
    const std::string what = "point to the other side than most do on the same surface";
    if (minority > mayStray && outward.sideIsGuessed && areTurnedAlongAxis(prepared)) {
      areWrong(minority, what + ", as all point to one side of an axis");
      return GivenSigns::ofAxis;
    }
    if (minority <= mayJoin || !lookAtWhatHardlySeesThem(prepared, execution))
      return GivenSigns::right;
    areWrong(minority, what + toOrigin);
    const bool isFromWithin =
        !outward.sideIsGuessed && inward > .5 && !hiddenOnSide(points, outward.normals, 1, search).areHardlyReached();
    return isFromWithin ? GivenSigns::mostlyInward : GivenSigns::wrong;
  }
  // The normals of rooms look inward as well. A sensor outside would not have seen the objects in a room.
  const bool mayBeRoom = inward > allLookInside && (isConsistent || !isFromOrigin);
  const std::vector<Eigen::Vector3f>& given = points.normals.empty() ? prepared.normals : points.normals;
  if (inward <= mayDisagree || (mayBeRoom && hiddenOnSide(points, given, -1, search).share > mayBeHidden))
    return GivenSigns::right;
  return areWrong(inward, "look into what the points enclose" + toOrigin);
}

} // namespace pcl::mrf

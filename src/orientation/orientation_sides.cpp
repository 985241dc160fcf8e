// SPDX-License-Identifier: BSD-3-Clause
#include "orientation/orientation_sides.h"

#include "base/select_values.h"
#include "orientation/given_signs.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace pcl::mrf {
namespace {

/// Components of fewer points are too small to tell what they enclose.
constexpr std::uint32_t minPointsOfShell = 50;

/// Share of open surface up to which there is no warning: holes and stray patches leave less.
constexpr double maxOpenWithoutWarning = .05;

/// Correlation of depth and spacing above which the side of the scanner shows.
constexpr double decisiveCorrelation = .6;

/// A height field is terrain if its axis has a cosine above `upright` with z, and above `shallow` with its mean normal;
/// a steeper one as well if a sensor was amid it, as in a street.
constexpr double upright = .85, shallow = .8;

/// Skewness of heights above which the side that things stand on shows.
constexpr double decisiveSkewness = .3;

/// The search for cavities looks at the maxShells largest closed components. At most shellSample points represent each
/// of them, and cavityProbes of its points are tested for being inside of another.
constexpr std::size_t maxShells = 64, shellSample = 4000, cavityProbes = 5;

/// Number of directions that the search for a common axis starts from, besides the coordinate axes.
constexpr std::size_t maxStarts = 16;

/// Max depth of a height field along one line of sight, in widths of that line.
constexpr double steepest = 4;

/// A small component looks for a larger one among neighborsAsked neighbors of its points, up to closeInReaches reaches.
constexpr int neighborsAsked = 32;
constexpr float closeInReaches = 2;

/// Points per piece of parallel work.
constexpr std::int64_t sidesGrain = 1024;

/// Whether two normals face the same side of a surface, by reflection at the bisector plane of the edge between them as
/// in OrientationGraph. If the edge leads along both normals there is no surface along it: they are compared directly.
bool agree(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& edge)
{
  const float length = edge.norm();
  const float alongA = length > 0 ? edge.dot(a) / length : 0, alongB = length > 0 ? edge.dot(b) / length : 0;
  const bool isAlongBoth = std::min(std::abs(alongA), std::abs(alongB)) > alongNormals;
  return a.dot(b) - (isAlongBoth ? 0 : 2 * alongA * alongB) >= 0;
}

/// Sums over the points of a component, areas up to one common factor.
struct Extent {
  Eigen::Vector3d vectorArea = Eigen::Vector3d::Zero(); ///< Σ A n: zero for a closed surface, whatever its shape
  double area = 0;
  Eigen::AlignedBox3f box;
  std::uint32_t points = 0;

  bool isOpen() const { return vectorArea.norm() > openFrom * area; }
};

/// Chooses the sides of the components.
class Chooser {
public:
  Chooser(const PointSet& points, const OutwardVotes& votes, const Reach& reach)
      : points_(points), normals_(votes.normals), areas_(votes.areas), components_(votes.components), reach_(reach),
        extents_(votes.components.sizes.size())
  {
    for (std::size_t i = 0; i < points.size(); ++i) {
      Extent& extent = extents_[components_.set[i]];
      extent.vectorArea += double{areas_[i]} * normals_[i].cast<double>();
      extent.area += normals_[i].isZero() ? 0.0 : double{areas_[i]};
      extent.box.extend(points.positions[i]);
      ++extent.points;
    }
    for (const Extent& extent : extents_)
      largest_ = std::max(largest_, extent.points);
    sides_.isTurned = votes.isTurned;
  }

  Sides choose(const NeighborSearch& search, Execution& execution)
  {
    double area = 0, openArea = 0, points = 0, openPoints = 0;
    for (std::size_t c = 0; c < extents_.size(); ++c)
      if (isTelling(c)) {
        area += extents_[c].area;
        points += extents_[c].points;
        openArea += extents_[c].isOpen() ? extents_[c].area : 0;
        openPoints += extents_[c].isOpen() ? extents_[c].points : 0;
      }
    // The smaller of the shares by area and by points, because a few outliers may stand for a large area.
    if (area > 0)
      sides_.openShare = std::min(openArea / area, openPoints / points);
    sides_.isGuess = sides_.openShare > maxOpenWithoutWarning;
    turnCavities();
    if (openArea > 0)
      alignOpenOnes();
    execution.poll();
    followNeighbors(search, execution);
    return std::move(sides_);
  }

private:
  bool isTelling(std::size_t c) const
  {
    return extents_[c].points >= std::min(minPointsOfShell, largest_) && extents_[c].area > 0;
  }
  bool isOpenPoint(std::size_t i) const
  {
    const std::uint32_t c = components_.set[i];
    return isTelling(c) && extents_[c].isOpen();
  }
  Eigen::Vector3f normal(std::size_t i) const
  {
    return sides_.isTurned[components_.set[i]] ? Eigen::Vector3f(-normals_[i]) : normals_[i];
  }

  /// How many times a closed shell of outward normals surrounds a position, from every stride-th of its points.
  double windingNumber(const std::vector<std::uint32_t>& shell, std::size_t stride, const Eigen::Vector3f& at) const
  {
    // The area of a point is π areas_: an m-th of the disc that reaches to its m-th neighbor.
    double solidAngle = 0;
    for (std::size_t n = 0; n < shell.size(); n += stride) {
      const Eigen::Vector3d r = (points_.positions[shell[n]] - at).cast<double>();
      const double distance = r.norm();
      if (distance > 0)
        solidAngle +=
            double{areas_[shell[n]]} * normal(shell[n]).cast<double>().dot(r) / (distance * distance * distance);
    }
    return static_cast<double>(stride) * solidAngle / 4;
  }

  /// Turns closed components inside an odd number of others: each bounds a cavity, and its outside is within it.
  void turnCavities()
  {
    std::vector<std::uint32_t> closed;
    for (std::uint32_t c = 0; c < extents_.size(); ++c)
      if (isTelling(c) && !extents_[c].isOpen())
        closed.push_back(c);
    // Only the largest ones, because many small ones would be slow.
    std::stable_sort(closed.begin(), closed.end(),
                     [&](std::uint32_t c, std::uint32_t d) { return extents_[c].points > extents_[d].points; });
    closed.resize(std::min(closed.size(), maxShells));
    if (closed.size() < 2)
      return;
    std::vector<std::vector<std::uint32_t>> members(extents_.size());
    for (std::uint32_t i = 0; i < points_.size(); ++i)
      if (std::find(closed.begin(), closed.end(), components_.set[i]) != closed.end())
        members[components_.set[i]].push_back(i);
    const auto isInside = [&](std::uint32_t c, std::uint32_t shell) {
      if (c == shell || !extents_[shell].box.contains(extents_[c].box))
        return false;
      const std::size_t stride = members[shell].size() / shellSample + 1;
      int inside = 0;
      for (std::size_t n = 0; n < cavityProbes; ++n) {
        const std::uint32_t probe = members[c][n * members[c].size() / cavityProbes];
        inside += windingNumber(members[shell], stride, points_.positions[probe]) > .5 ? 1 : -1;
      }
      return inside > 0;
    };
    std::vector<std::uint32_t> cavities;
    for (const std::uint32_t c : closed)
      if (std::count_if(closed.begin(), closed.end(), [&](std::uint32_t d) { return isInside(c, d); }) % 2 == 1)
        cavities.push_back(c);
    for (const std::uint32_t c : cavities)
      sides_.isTurned[c] ^= 1;
  }

  /// The direction that the open components face with the largest area, if each is turned to it: a single scanner's.
  Eigen::Vector3d commonAxis() const
  {
    std::vector<Eigen::Vector3d> areas;
    for (std::size_t c = 0; c < extents_.size(); ++c)
      if (isTelling(c) && extents_[c].isOpen())
        areas.push_back(extents_[c].vectorArea);
    std::vector<Eigen::Vector3d> starts = areas;
    const std::size_t tried = std::min(starts.size(), maxStarts);
    std::partial_sort(starts.begin(), starts.begin() + tried, starts.end(),
                      [](const auto& a, const auto& b) { return a.squaredNorm() > b.squaredNorm(); });
    starts.resize(tried);
    for (int axis = 0; axis < 3; ++axis)
      starts.emplace_back(Eigen::Vector3d::Unit(axis));
    Eigen::Vector3d best = Eigen::Vector3d::Zero();
    for (Eigen::Vector3d sum : starts)
      for (double previous = -1; sum.norm() > previous;) {
        previous = sum.norm();
        const Eigen::Vector3d along = sum;
        sum.setZero();
        for (const Eigen::Vector3d& area : areas)
          sum += area.dot(along) < 0 ? Eigen::Vector3d(-area) : area;
        if (sum.norm() > best.norm())
          best = sum;
      }
    return best.normalized();
  }

  /// Whether most lines along the axis meet the open components at one depth only.
  bool isHeightField(const Eigen::Vector3d& axis) const
  {
    std::vector<float> reaches;
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (isOpenPoint(i))
        reaches.push_back(reach_.of(i));
    const double side = median(std::move(reaches));
    if (!(side > 0))
      return false;
    const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
    struct Depths {
      double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
    };
    std::unordered_map<std::uint64_t, Depths> cells;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (!isOpenPoint(i))
        continue;
      const Eigen::Vector3d p = points_.positions[i].cast<double>();
      // Each coordinate takes half of the key. Points farther than 2³¹ cells away may share a cell.
      const auto cell = [&](const Eigen::Vector3d& along) {
        return static_cast<std::uint32_t>(
            static_cast<std::int64_t>(std::clamp(std::floor(p.dot(along) / side), -2147483648.0, 2147483647.0)));
      };
      Depths& depths = cells[std::uint64_t{cell(u)} << 32 | cell(v)];
      depths.nearest = std::min(depths.nearest, p.dot(axis));
      depths.farthest = std::max(depths.farthest, p.dot(axis));
    }
    std::size_t deep = 0;
    for (const auto& [key, depths] : cells)
      deep += depths.farthest - depths.nearest > steepest * side;
    return 2 * deep < cells.size();
  }

  /// > 0 if the scanner was on the axis' side, < 0 if it was on the other side, 0 if that does not show. The angle
  /// between a scanner's rays is constant, so that the spacing grows with the distance and the tilt of the surface.
  double sideOfScanner(const Eigen::Vector3d& axis) const
  {
    if (!reach_.isLocal())
      return 0;
    // Sums over depth, logarithm of the tilt's cosine, and logarithm of the spacing.
    double count = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double cosine = std::abs(normals_[i].cast<double>().dot(axis));
      // In a grazing view the spacing depends on the error of the angle, not on the distance.
      if (!isOpenPoint(i) || cosine < .2 || !(reach_.of(i) > 0))
        continue;
      const Eigen::Vector3d values(points_.positions[i].cast<double>().dot(axis), std::log(cosine),
                                   std::log(double{reach_.of(i)}));
      ++count;
      sum += values;
      products += values * values.transpose();
    }
    if (!(count > 0))
      return 0;
    // Partial correlation of depth and spacing, without the part of both that the tilt explains.
    const Eigen::Matrix3d covariance = products / count - sum * sum.transpose() / (count * count);
    const double tilt = covariance(1, 1) > 0 ? 1 / covariance(1, 1) : 0;
    const auto left = [&](int i, int j) { return covariance(i, j) - tilt * covariance(i, 1) * covariance(j, 1); };
    const double variances = left(0, 0) * left(2, 2);
    const double correlation = variances > 0 ? left(0, 2) / std::sqrt(variances) : 0;
    return std::abs(correlation) > decisiveCorrelation ? -correlation : 0;
  }

  bool isTerrain(const Eigen::Vector3d& axis) const
  {
    double along = 0, area = 0;
    for (std::size_t c = 0; c < extents_.size(); ++c)
      if (isTelling(c) && extents_[c].isOpen()) {
        along += std::abs(extents_[c].vectorArea.dot(axis));
        area += extents_[c].area;
      }
    return std::abs(axis.z()) > upright && (along > shallow * area || isUneven(points_));
  }

  /// > 0 if the open components together face away from their middle, < 0 if they face it, 0 if neither is clear.
  double outside() const
  {
    const double result = outwardness(
        points_.positions, areas_,
        [&](const auto& visit) {
          for (std::size_t i = 0; i < points_.size(); ++i)
            if (isOpenPoint(i))
              visit(i);
        },
        [&](std::size_t i) { return normal(i); });
    return std::abs(result) >= .5 ? result : 0;
  }

  /// The skewness of heights along the axis: > 0 if things rise from the bulk of the surface along the axis, as a house
  /// from its plot, < 0 if they rise against it. 0 if that does not show.
  double sideOfThings(const Eigen::Vector3d& axis) const
  {
    double area = 0, sum = 0, squares = 0, cubes = 0;
    const auto forHeights = [&](const auto& visit) {
      for (std::size_t i = 0; i < points_.size(); ++i)
        if (isOpenPoint(i))
          visit(double{areas_[i]}, points_.positions[i].cast<double>().dot(axis));
    };
    forHeights([&](double weight, double height) {
      area += weight;
      sum += weight * height;
    });
    forHeights([&](double weight, double height) {
      const double above = height - sum / area;
      squares += weight * above * above;
      cubes += weight * above * above * above;
    });
    const double skewness = cubes / area / std::pow(squares / area, 1.5);
    return std::abs(skewness) > decisiveSkewness ? skewness : 0;
  }

  /// Turns the open components of a height field to one side of it.
  void alignOpenOnes()
  {
    const Eigen::Vector3d axis = commonAxis();
    if (!isHeightField(axis))
      return;
    axis_ = axis;
    const auto turnTo = [&](const Eigen::Vector3d& side) {
      for (std::size_t c = 0; c < extents_.size(); ++c)
        if (isTelling(c) && extents_[c].isOpen())
          sides_.isTurned[c] = extents_[c].vectorArea.dot(side) < 0 ? 1 : 0;
    };
    turnTo(axis_);
    double side = sideOfScanner(axis_);
    if (side == 0 && isTerrain(axis_))
      side = axis_.z();
    if (side == 0)
      side = outside();
    if (side == 0)
      side = sideOfThings(axis_);
    if (side == 0) {
      int longest = 0;
      axis_.cwiseAbs().maxCoeff(&longest);
      side = axis_[longest];
    }
    if (side < 0) {
      axis_ = -axis_;
      turnTo(axis_);
    }
  }

  /// Turns small components to agree with the nearest point of a larger one, if that is close; otherwise, if more than
  /// half of the surface is open, to the side of the common height field.
  void followNeighbors(const NeighborSearch& search, Execution& execution)
  {
    std::vector<std::uint32_t> small;
    for (std::uint32_t i = 0; i < points_.size(); ++i)
      if (!isTelling(components_.set[i]) && !normals_[i].isZero())
        small.push_back(i);
    struct Neighbor {
      float squaredDistance = std::numeric_limits<float>::infinity();
      std::uint32_t point = 0;
    };
    std::vector<Neighbor> nearest(small.size());
    execution.forRange(small.size(), sidesGrain, [&](std::size_t begin, std::size_t end) {
      Neighbors found;
      for (std::size_t n = begin; n < end; ++n) {
        const int number = search.nearest(points_.positions[small[n]], neighborsAsked, found);
        for (std::size_t m = 0; m < static_cast<std::size_t>(number); ++m) {
          const auto j = static_cast<std::uint32_t>(found.indices[m]);
          if (!isTelling(components_.set[j]) || normals_[j].isZero())
            continue;
          const float close = closeInReaches * std::max(reach_.of(small[n]), reach_.of(j));
          if (found.squaredDistances[m] <= close * close)
            nearest[n] = {found.squaredDistances[m], j};
          break;
        }
      }
    });
    std::unordered_map<std::uint32_t, std::size_t> closest; // by component, into `small`
    for (std::size_t n = 0; n < small.size(); ++n) {
      const std::uint32_t c = components_.set[small[n]];
      const auto place = closest.emplace(c, n).first;
      if (nearest[n].squaredDistance < nearest[place->second].squaredDistance)
        place->second = n;
    }
    for (const auto& [c, n] : closest) {
      if (std::isfinite(nearest[n].squaredDistance)) {
        const std::uint32_t i = small[n], j = nearest[n].point;
        sides_.isTurned[c] = agree(normals_[i], normal(j), points_.positions[j] - points_.positions[i]) ? 0 : 1;
      } else if (!axis_.isZero() && 2 * sides_.openShare > 1)
        sides_.isTurned[c] = extents_[c].vectorArea.dot(axis_) < 0 ? 1 : 0;
    }
  }

  const PointSet& points_;
  const std::vector<Eigen::Vector3f>& normals_;
  const std::vector<float>& areas_;
  const Partition& components_;
  const Reach& reach_;
  std::vector<Extent> extents_;                    ///< per component
  std::uint32_t largest_ = 0;                      ///< points of the largest component
  Eigen::Vector3d axis_ = Eigen::Vector3d::Zero(); ///< of the open components' common height field; zero: none
  Sides sides_;
};

} // namespace

Sides chooseSides(const PointSet& points, const OutwardVotes& votes, const Reach& reach, const NeighborSearch& search,
                  Execution& execution)
{
  return Chooser(points, votes, reach).choose(search, execution);
}

} // namespace pcl::mrf

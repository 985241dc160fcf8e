// SPDX-License-Identifier: BSD-3-Clause
/// Decides whether the remesher may replace a triangle by another one.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>

namespace pcl::mrf {

/// A vertex of the remesher: its position and the field's unit normal there.
struct Corner {
  Eigen::Vector3f position, normal;
};

/// Shape and direction of a triangle. Of two triangles: the worse values of both, and the sum of their normals.
struct TriangleShape {
  /// Min shape, and min cosine between the triangle's normal and the field's. An operation with less is refused, unless
  /// it makes things no worse: marching cubes leaves slivers and crooked triangles, which must be free to improve.
  static constexpr float minShape = .1f, minCosine = .6f;
  /// Cosine of the largest angle by which a sound triangle may turn in one operation.
  static constexpr float minTurnCosine = .5f;

  Eigen::Vector3f cross = Eigen::Vector3f::Zero(); ///< normal; its length is twice the area
  float shape = 1;                                 ///< 4√3 area / sum of squared sides: 1 equilateral, 0 degenerate
  float cosine = 1;                                ///< between its normal and the field's
  float turn = 0;                                  ///< largest squared angle by which the normals turn along an edge

  TriangleShape() = default;

  TriangleShape(const Corner& a, const Corner& b, const Corner& c)
  {
    const Eigen::Vector3f u = b.position - a.position, v = c.position - a.position, w = c.position - b.position;
    cross = u.cross(v);
    const float doubleArea = cross.norm();
    const float sides = u.squaredNorm() + v.squaredNorm() + w.squaredNorm();
    const Eigen::Vector3f normal = a.normal + b.normal + c.normal;
    shape = sides > 0 ? 3.46410162f * doubleArea / sides : 0;
    const float lengths = doubleArea * normal.norm();
    cosine = lengths > 0 ? cross.dot(normal) / lengths : -1;
    turn = std::max(
        {turnAlong(u, b.normal - a.normal), turnAlong(v, c.normal - a.normal), turnAlong(w, c.normal - b.normal)});
  }

  TriangleShape operator&(const TriangleShape& other) const
  {
    TriangleShape both;
    both.cross = cross + other.cross;
    both.shape = std::min(shape, other.shape);
    both.cosine = std::min(cosine, other.cosine);
    both.turn = std::max(turn, other.turn);
    return both;
  }

  bool isSliver() const { return shape < minShape; }
  bool sound() const { return !isSliver() && cosine >= minCosine; }

  /// \param maxTurn max of `turn`; more is refused, unless `former` turned as much or was a sliver
  bool mayReplace(const TriangleShape& former, float maxTurn) const
  {
    if (!(shape >= std::min(minShape, former.shape) && cosine >= std::min(minCosine, former.cosine) && shape > 1e-4f))
      return false;
    if (!former.isSliver() && turn > std::max(maxTurn, former.turn))
      return false;
    return !former.sound() || turnsLittle(former);
  }

  bool turnsLittle(const TriangleShape& former) const { return turnsLittle(former.cross); }
  bool turnsLittle(const Eigen::Vector3f& former) const
  {
    return cross.dot(former) >= minTurnCosine * cross.norm() * former.norm();
  }

private:
  /// Squared angle by which the normals turn along an edge: for small angles, their difference in its direction.
  static float turnAlong(const Eigen::Vector3f& edge, const Eigen::Vector3f& difference)
  {
    const float length = edge.squaredNorm(), along = edge.dot(difference);
    return length > 0 ? along * along / length : 0;
  }
};

} // namespace pcl::mrf

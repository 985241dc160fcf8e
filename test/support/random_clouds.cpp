// SPDX-License-Identifier: BSD-3-Clause
#include "support/random_clouds.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace random_clouds {
namespace {

using Eigen::Vector3d;

constexpr double pi = 3.14159265358979323846;

/// Enough for a surface, few enough for milliseconds.
std::size_t count(Random& random)
{
  return static_cast<std::size_t>(random.decades(1.5, 3.2));
}

void add(Cloud& cloud, const Vector3d& position, const Vector3d& normal)
{
  cloud.positions.push_back(position);
  cloud.normals.push_back(normal);
}

void addSphere(Cloud& cloud, std::size_t points, const Vector3d& center, double radius, Random& random)
{
  for (std::size_t n = 0; n < points; ++n) {
    const Vector3d normal = random.direction();
    add(cloud, center + radius * normal, normal);
  }
}

/// A square of side 2 in z = 0 around the center, moved and turned.
void addSquare(Cloud& cloud, std::size_t points, const Vector3d& center, const Eigen::Matrix3d& turn, Random& random)
{
  for (std::size_t n = 0; n < points; ++n)
    add(cloud, center + turn * Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), 0), turn.col(2));
}

Eigen::Matrix3d turned(Random& random)
{
  return Eigen::AngleAxisd(random.uniform(0, pi), random.direction()).toRotationMatrix();
}

Cloud sphere(Random& random)
{
  Cloud cloud;
  addSphere(cloud, count(random), random.inCube(), random.decades(-2, 2), random);
  return cloud;
}

Cloud evenSphere(Random& random)
{
  Cloud cloud;
  const std::size_t points = count(random);
  for (std::size_t n = 0; n < points; ++n) { // a spiral of equal areas
    const double z = 1 - (2 * static_cast<double>(n) + 1) / static_cast<double>(points);
    const double around = pi * (1 + std::sqrt(5.)) * static_cast<double>(n), r = std::sqrt(1 - z * z);
    const Vector3d normal(r * std::cos(around), r * std::sin(around), z);
    add(cloud, normal, normal);
  }
  return cloud;
}

/// Changes every point of a cloud.
template <typename Change>
Cloud changed(Cloud cloud, const Change& change)
{
  for (std::size_t n = 0; n < cloud.positions.size(); ++n)
    change(cloud.positions[n], cloud.normals[n]);
  return cloud;
}

/// Keeps the points that fulfill a condition.
template <typename Condition>
Cloud kept(const Cloud& cloud, const Condition& condition)
{
  Cloud result;
  for (std::size_t n = 0; n < cloud.positions.size(); ++n)
    if (condition(cloud.positions[n]))
      add(result, cloud.positions[n], cloud.normals[n]);
  return result;
}

Cloud cap(Random& random)
{
  const double below = random.uniform(-.9, .9);
  return kept(evenSphere(random), [=](const Vector3d& p) { return p.z() > below; });
}

Cloud noisySphere(Random& random)
{
  const double sigma = random.uniform(0, .3);
  return changed(sphere(random), [&](Vector3d& p, Vector3d& n) { p += sigma * random.uniform(-1, 1) * n; });
}

Cloud torus(Random& random)
{
  Cloud cloud;
  const double tube = random.uniform(.05, 1.2); // above 1 it intersects itself
  for (std::size_t left = count(random); left > 0; --left) {
    const double u = random.uniform(0, 2 * pi), v = random.uniform(0, 2 * pi);
    const Vector3d out(std::cos(u), std::sin(u), 0), normal = std::cos(v) * out + std::sin(v) * Vector3d::UnitZ();
    add(cloud, out + tube * normal, normal);
  }
  return cloud;
}

Cloud moebiusStrip(Random& random)
{
  Cloud cloud;
  for (std::size_t left = count(random); left > 0; --left) {
    const double u = random.uniform(0, 2 * pi), v = random.uniform(-.4, .4);
    const Vector3d out(std::cos(u), std::sin(u), 0);
    const Vector3d across = std::cos(u / 2) * out + std::sin(u / 2) * Vector3d::UnitZ();
    add(cloud, out + v * across, across.cross(Vector3d(-std::sin(u), std::cos(u), 0)));
  }
  return cloud;
}

Cloud coplanar(Random& random)
{
  Cloud cloud;
  addSquare(cloud, count(random), Vector3d::Zero(), turned(random), random);
  return cloud;
}

/// Squares and cubes whose points lie on a lattice, and with it on planes and corners of voxels.
Cloud onLattice(Random& random)
{
  Cloud cloud;
  const int side = 2 + static_cast<int>(random.index(24));
  const bool isCube = random.oneIn(2);
  for (int i = 0; i <= side; ++i)
    for (int j = 0; j <= side; ++j)
      for (int axis = 0; axis < (isCube ? 3 : 1); ++axis)
        for (const int face : {0, side}) {
          Vector3d p, normal = Vector3d::Zero();
          p[axis] = face;
          p[(axis + 1) % 3] = i;
          p[(axis + 2) % 3] = j;
          normal[axis] = face == 0 ? -1 : 1;
          if (isCube || face == 0)
            add(cloud, p, normal);
        }
  return cloud;
}

Cloud collinear(Random& random)
{
  Cloud cloud;
  const Vector3d along = random.direction();
  for (std::size_t left = count(random); left > 0; --left)
    add(cloud, random.uniform(-1, 1) * along, random.direction());
  return cloud;
}

Cloud helix(Random& random)
{
  Cloud cloud;
  for (std::size_t left = count(random); left > 0; --left) {
    const double t = random.uniform(0, 20);
    const Vector3d out(std::cos(t), std::sin(t), 0);
    add(cloud, out + .1 * t * Vector3d::UnitZ(), out);
  }
  return cloud;
}

Cloud twoFarClusters(Random& random)
{
  Cloud cloud;
  const std::size_t points = count(random);
  addSphere(cloud, points, Vector3d::Zero(), 1, random);
  addSphere(cloud, points, random.decades(.5, 6) * random.direction(), random.decades(-1, 1), random);
  return cloud;
}

Cloud manySpheres(Random& random)
{
  Cloud cloud;
  for (std::size_t left = 2 + random.index(30); left > 0; --left)
    addSphere(cloud, 5 + random.index(100), random.decades(0, 2) * random.inCube(), random.decades(-1, .5), random);
  return cloud;
}

Cloud shellsInShells(Random& random)
{
  Cloud cloud;
  double radius = 1;
  for (std::size_t left = 2 + random.index(4); left > 0; --left) {
    addSphere(cloud, count(random), Vector3d::Zero(), radius, random);
    radius *= random.uniform(.5, .999);
  }
  return cloud;
}

Cloud twoSheets(Random& random)
{
  Cloud cloud;
  const std::size_t points = count(random);
  addSquare(cloud, points, Vector3d::Zero(), Eigen::Matrix3d::Identity(), random);
  addSquare(cloud, points, random.decades(-4, -.5) * Vector3d::UnitZ(), Eigen::Matrix3d::Identity(), random);
  const bool opposed = random.oneIn(2);
  for (std::size_t n = 0; opposed && n < points; ++n)
    cloud.normals[n] *= -1;
  return cloud;
}

Cloud crossingPlanes(Random& random)
{
  Cloud cloud;
  const std::size_t points = count(random);
  for (std::size_t left = 2 + random.index(3); left > 0; --left)
    addSquare(cloud, points, Vector3d::Zero(), turned(random), random);
  return cloud;
}

Cloud noiseCube(Random& random)
{
  Cloud cloud;
  for (std::size_t left = count(random); left > 0; --left)
    add(cloud, random.inCube(), random.direction());
  return cloud;
}

/// Distances over many decades.
Cloud spread(Random& random)
{
  Cloud cloud;
  const double powers = random.uniform(1, 12);
  for (std::size_t left = 4 + random.index(400); left > 0; --left)
    add(cloud, random.decades(-powers, powers) * random.direction(), random.direction());
  return cloud;
}

Cloud dust(Random& random)
{
  Cloud cloud;
  for (std::size_t left = count(random); left > 0; --left) { // Cantor's, in three dimensions
    Vector3d p = Vector3d::Zero();
    double size = 1;
    for (int level = 0; level < 12; ++level, size /= 3)
      p += size * Vector3d(double(random.index(2)), double(random.index(2)), double(random.index(2)));
    add(cloud, p, random.direction());
  }
  return cloud;
}

Cloud fewPoints(Random& random)
{
  Cloud cloud;
  for (std::size_t left = random.index(13); left > 0; --left)
    add(cloud, random.inCube(), random.direction());
  return cloud;
}

Cloud identicalPoints(Random& random)
{
  Cloud cloud;
  const Vector3d at = random.inCube(), normal = random.direction();
  for (std::size_t left = 100000; left > 0; --left)
    add(cloud, at, normal);
  if (random.oneIn(2))
    addSphere(cloud, count(random), at, 1, random);
  return cloud;
}

Cloud repeatedPoints(Random& random)
{
  const Cloud once = sphere(random);
  Cloud cloud = once;
  for (std::size_t left = 1 + random.index(10); left > 0; --left)
    for (std::size_t n = 0; n < once.positions.size(); ++n)
      add(cloud, once.positions[n], random.oneIn(4) ? random.direction() : once.normals[n]);
  return cloud;
}

/// One half of the sphere a thousand times as dense.
Cloud unevenDensity(Random& random)
{
  Cloud cloud;
  for (int left = 2000; left > 0; --left) {
    Vector3d normal = random.direction();
    normal.z() = random.oneIn(1000) ? -std::abs(normal.z()) : std::abs(normal.z());
    add(cloud, normal, normal);
  }
  return cloud;
}

/// Lines of a scanner: far apart beside the distances along them.
Cloud lines(Random& random)
{
  Cloud cloud;
  const std::size_t rows = 2 + random.index(20), columns = 20 + random.index(150);
  for (std::size_t row = 0; row < rows; ++row)
    for (std::size_t column = 0; column < columns; ++column) {
      const double u = static_cast<double>(row) / static_cast<double>(rows),
                   v = static_cast<double>(column) / static_cast<double>(columns);
      add(cloud, {v, u, .2 * std::sin(3 * u + 5 * v)}, Vector3d::UnitZ());
    }
  return cloud;
}

/// What a camera of distances sees: steps in depth, and pixels without a distance.
Cloud rangeImage(Random& random)
{
  Cloud cloud;
  const int side = 8 + static_cast<int>(random.index(40));
  const double step = random.uniform(0, 2);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const double depth = 2 + (x > side / 2 ? step : 0) + (y > side / 3 ? .1 * y : 0);
      const Vector3d ray(double(x) / side - .5, double(y) / side - .5, 1);
      const bool isMissing = random.oneIn(10);
      const double nothing = std::numeric_limits<double>::quiet_NaN();
      add(cloud, isMissing ? Vector3d::Constant(nothing) : Vector3d(depth * ray), -ray.normalized());
    }
  cloud.sensors = {Vector3d::Zero()};
  return cloud;
}

Cloud anisotropic(Random& random)
{
  const Vector3d factors(random.decades(-3, 3), random.decades(-3, 3), 1);
  return changed(sphere(random), [&](Vector3d& p, Vector3d& n) {
    p = p.cwiseProduct(factors).eval();
    n = n.cwiseQuotient(factors).normalized().eval();
  });
}

Cloud sphereAndOutliers(Random& random)
{
  Cloud cloud = sphere(random);
  for (std::size_t left = 1 + random.index(10); left > 0; --left)
    add(cloud, random.decades(0, 8) * random.direction(), random.direction());
  return cloud;
}

Cloud scaledBy(double lowerPower, double upperPower, Random& random)
{
  const double factor = random.decades(lowerPower, upperPower);
  return changed(noisySphere(random), [=](Vector3d& p, Vector3d&) { p *= factor; });
}

Cloud hugeScale(Random& random)
{
  return scaledBy(6, 38, random);
}

Cloud tinyScale(Random& random)
{
  return scaledBy(-46, -6, random); // down to denormal numbers and zero
}

Cloud hugeOffset(Random& random)
{
  const Vector3d offset = random.decades(3, 30) * random.direction();
  return changed(sphere(random), [&](Vector3d& p, Vector3d&) { p += offset; });
}

Cloud notFinite(Random& random)
{
  const double values[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity(), 1e308};
  return changed(sphere(random), [&](Vector3d& p, Vector3d& n) {
    if (random.oneIn(4))
      (random.oneIn(2) ? p : n)[static_cast<Eigen::Index>(random.index(3))] = values[random.index(4)];
  });
}

Cloud zeroNormals(Random& random)
{
  const std::size_t one = random.oneIn(2) ? 1 : 1 + random.index(10);
  return changed(sphere(random), [&](Vector3d&, Vector3d& n) {
    if (random.oneIn(one))
      n.setZero();
  });
}

Cloud equalNormals(Random& random)
{
  const Vector3d normal = random.direction();
  return changed(sphere(random), [&](Vector3d&, Vector3d& n) { n = normal; });
}

Cloud randomNormals(Random& random)
{
  return changed(sphere(random), [&](Vector3d&, Vector3d& n) { n = random.decades(-30, 30) * random.direction(); });
}

Cloud flippedNormals(Random& random)
{
  const bool all = random.oneIn(2);
  return changed(sphere(random), [&](Vector3d&, Vector3d& n) { n *= all || random.oneIn(2) ? -1 : 1; });
}

void addSensors(Cloud& cloud, Random& random)
{
  for (std::size_t left = 1 + random.index(3); left > 0; --left)
    cloud.sensors.push_back(random.decades(-1, 3) * random.direction());
  if (random.oneIn(2))
    for (std::size_t n = 0; n < cloud.positions.size(); ++n)
      cloud.views.push_back(static_cast<std::int32_t>(random.index(cloud.sensors.size())));
}

} // namespace

double Random::uniform(double lower, double upper)
{
  constexpr double all = 18446744073709551616.;
  return lower + (upper - lower) * (static_cast<double>(engine_()) / all);
}

double Random::decades(double lowerPower, double upperPower)
{
  return std::pow(10., uniform(lowerPower, upperPower));
}

Vector3d Random::inCube()
{
  const double x = uniform(-1, 1), y = uniform(-1, 1);
  return {x, y, uniform(-1, 1)};
}

Vector3d Random::direction()
{
  const double z = uniform(-1, 1), around = uniform(0, 2 * pi), r = std::sqrt(1 - z * z);
  return {r * std::cos(around), r * std::sin(around), z};
}

const std::vector<Kind>& kinds()
{
  static const std::vector<Kind> all = {{"sphere", sphere},
                                        {"even sphere", evenSphere},
                                        {"cap", cap},
                                        {"noisy sphere", noisySphere},
                                        {"torus", torus},
                                        {"Moebius strip", moebiusStrip},
                                        {"coplanar", coplanar},
                                        {"on a lattice", onLattice},
                                        {"collinear", collinear},
                                        {"helix", helix},
                                        {"two far clusters", twoFarClusters},
                                        {"many spheres", manySpheres},
                                        {"shells in shells", shellsInShells},
                                        {"two sheets", twoSheets},
                                        {"crossing planes", crossingPlanes},
                                        {"noise cube", noiseCube},
                                        {"spread", spread},
                                        {"dust", dust},
                                        {"few points", fewPoints},
                                        {"identical points", identicalPoints},
                                        {"repeated points", repeatedPoints},
                                        {"uneven density", unevenDensity},
                                        {"lines", lines},
                                        {"range image", rangeImage},
                                        {"anisotropic", anisotropic},
                                        {"outliers", sphereAndOutliers},
                                        {"huge scale", hugeScale},
                                        {"tiny scale", tinyScale},
                                        {"huge offset", hugeOffset},
                                        {"not finite", notFinite},
                                        {"zero normals", zeroNormals},
                                        {"equal normals", equalNormals},
                                        {"random normals", randomNormals},
                                        {"flipped normals", flippedNormals}};
  return all;
}

Cloud drawCloud(const Kind& kind, Random& random)
{
  Cloud cloud = kind.make(random);
  cloud.kind = kind.name;
  if (random.oneIn(4))
    cloud.normals.clear();
  cloud.hasColors = random.oneIn(4);
  if (random.oneIn(6))
    addSensors(cloud, random);
  if (random.oneIn(10))
    for (std::size_t n = 0; n < cloud.positions.size(); ++n)
      cloud.confidences.push_back(static_cast<float>(random.uniform(-.1, 1.1)));
  return cloud;
}

} // namespace random_clouds

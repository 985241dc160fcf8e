// SPDX-License-Identifier: BSD-3-Clause
// Clouds of every kind with valid options of every kind. Every run gives a valid mesh, or one clear error and no mesh,
// within limits of time and memory.
//   test_random_clouds [CASES [FIRST_SEED]]
// A case is named by its seed, which is printed before it runs, in case it ends the process.
#include "mesh/self_intersection.h"
#include "support/clouds.h"
#include "support/conversion.h"
#include "support/random.h"

#include <pcl/surface/mrf/option_table.h>
#include <pcl/surface/mrf/report.h>
#include <pcl/surface/mrf/triangle_mesh.h>
#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/console/print.h>

#include <Eigen/Geometry>

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

using namespace pcl::mrf;
using clouds::Random;
using Eigen::Vector3d;

namespace {

/// The input that a user gives to the class.
struct Cloud {
  std::string kind;
  std::vector<Vector3d> positions;
  std::vector<Vector3d> normals;  ///< as many, or none
  std::vector<float> confidences; ///< as many, or none
  std::vector<Vector3d> sensors;
  std::vector<std::int32_t> views; ///< one per point, or none
};

/// A function that fills a cloud with points of one kind.
struct Kind {
  const char* name;
  void (*make)(Cloud&, Random&);
};

/// A random number of points: enough for a surface, few enough for a run of milliseconds.
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

/// Adds a square of side 2 around the center, turned.
void addSquare(Cloud& cloud, std::size_t points, const Vector3d& center, const Eigen::Matrix3d& turn, Random& random)
{
  for (std::size_t n = 0; n < points; ++n)
    add(cloud, center + turn * Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), 0), turn.col(2));
}

Eigen::Matrix3d turned(Random& random)
{
  return Eigen::AngleAxisd(random.uniform(0, M_PI), random.direction()).toRotationMatrix();
}

void sphere(Cloud& cloud, Random& random)
{
  addSphere(cloud, count(random), random.inCube(), random.decades(-2, 2), random);
}

void evenSphere(Cloud& cloud, Random& random)
{
  for (const Vector3d& normal : clouds::spherePoints(count(random)))
    add(cloud, normal, normal);
}

/// Changes every point of a cloud.
template <typename Change>
void changeAll(Cloud& cloud, const Change& change)
{
  for (std::size_t n = 0; n < cloud.positions.size(); ++n)
    change(cloud.positions[n], cloud.normals[n]);
}

void noisySphere(Cloud& cloud, Random& random)
{
  const double sigma = random.uniform(0, .3);
  sphere(cloud, random);
  changeAll(cloud, [&](Vector3d& p, Vector3d& n) { p += sigma * random.uniform(-1, 1) * n; });
}

void scaledBy(double lowerPower, double upperPower, Cloud& cloud, Random& random)
{
  const double factor = random.decades(lowerPower, upperPower);
  noisySphere(cloud, random);
  changeAll(cloud, [=](Vector3d& p, Vector3d&) { p *= factor; });
}

void addSensors(Cloud& cloud, Random& random)
{
  for (std::size_t left = 1 + random.index(3); left > 0; --left)
    cloud.sensors.push_back(random.decades(-1, 3) * random.direction());
  if (random.oneIn(2))
    for (std::size_t n = 0; n < cloud.positions.size(); ++n)
      cloud.views.push_back(static_cast<std::int32_t>(random.index(cloud.sensors.size())));
}

const std::vector<Kind> kinds = {
    {"sphere", sphere},
    {"even sphere", evenSphere},
    {"cap",
     [](Cloud& cloud, Random& random) {
       const double below = random.uniform(-.9, .9);
       Cloud whole;
       evenSphere(whole, random);
       for (const Vector3d& p : whole.positions)
         if (p.z() > below)
           add(cloud, p, p);
     }},
    {"noisy sphere", noisySphere},
    {"torus",
     [](Cloud& cloud, Random& random) {
       const double tube = random.uniform(.05, 1.2); // above 1 it intersects itself
       for (std::size_t left = count(random); left > 0; --left) {
         const double u = random.uniform(0, 2 * M_PI), v = random.uniform(0, 2 * M_PI);
         const Vector3d out(std::cos(u), std::sin(u), 0), normal = std::cos(v) * out + std::sin(v) * Vector3d::UnitZ();
         add(cloud, out + tube * normal, normal);
       }
     }},
    {"Moebius strip",
     [](Cloud& cloud, Random& random) {
       for (std::size_t left = count(random); left > 0; --left) {
         const double u = random.uniform(0, 2 * M_PI), v = random.uniform(-.4, .4);
         const Vector3d out(std::cos(u), std::sin(u), 0);
         const Vector3d across = std::cos(u / 2) * out + std::sin(u / 2) * Vector3d::UnitZ();
         add(cloud, out + v * across, across.cross(Vector3d(-std::sin(u), std::cos(u), 0)));
       }
     }},
    {"coplanar",
     [](Cloud& cloud, Random& random) { addSquare(cloud, count(random), Vector3d::Zero(), turned(random), random); }},
    // Squares and cubes whose points lie on a lattice, and with it on planes and corners of voxels.
    {"on a lattice",
     [](Cloud& cloud, Random& random) {
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
     }},
    {"collinear",
     [](Cloud& cloud, Random& random) {
       const Vector3d along = random.direction();
       for (std::size_t left = count(random); left > 0; --left)
         add(cloud, random.uniform(-1, 1) * along, random.direction());
     }},
    {"helix",
     [](Cloud& cloud, Random& random) {
       for (std::size_t left = count(random); left > 0; --left) {
         const double t = random.uniform(0, 20);
         const Vector3d out(std::cos(t), std::sin(t), 0);
         add(cloud, out + .1 * t * Vector3d::UnitZ(), out);
       }
     }},
    {"two far clusters",
     [](Cloud& cloud, Random& random) {
       const std::size_t points = count(random);
       addSphere(cloud, points, Vector3d::Zero(), 1, random);
       addSphere(cloud, points, random.decades(.5, 6) * random.direction(), random.decades(-1, 1), random);
     }},
    {"many spheres",
     [](Cloud& cloud, Random& random) {
       for (std::size_t left = 2 + random.index(30); left > 0; --left)
         addSphere(cloud, 5 + random.index(100), random.decades(0, 2) * random.inCube(), random.decades(-1, .5),
                   random);
     }},
    {"shells in shells",
     [](Cloud& cloud, Random& random) {
       double radius = 1;
       for (std::size_t left = 2 + random.index(4); left > 0; --left) {
         addSphere(cloud, count(random), Vector3d::Zero(), radius, random);
         radius *= random.uniform(.5, .999);
       }
     }},
    {"two sheets",
     [](Cloud& cloud, Random& random) {
       const std::size_t points = count(random);
       addSquare(cloud, points, Vector3d::Zero(), Eigen::Matrix3d::Identity(), random);
       addSquare(cloud, points, random.decades(-4, -.5) * Vector3d::UnitZ(), Eigen::Matrix3d::Identity(), random);
       const bool opposed = random.oneIn(2);
       for (std::size_t n = 0; opposed && n < points; ++n)
         cloud.normals[n] *= -1;
     }},
    {"crossing planes",
     [](Cloud& cloud, Random& random) {
       const std::size_t points = count(random);
       for (std::size_t left = 2 + random.index(3); left > 0; --left)
         addSquare(cloud, points, Vector3d::Zero(), turned(random), random);
     }},
    {"noise cube",
     [](Cloud& cloud, Random& random) {
       for (std::size_t left = count(random); left > 0; --left)
         add(cloud, random.inCube(), random.direction());
     }},
    // Distances over many decades.
    {"spread",
     [](Cloud& cloud, Random& random) {
       const double powers = random.uniform(1, 12);
       for (std::size_t left = 4 + random.index(400); left > 0; --left)
         add(cloud, random.decades(-powers, powers) * random.direction(), random.direction());
     }},
    {"dust",
     [](Cloud& cloud, Random& random) {
       for (std::size_t left = count(random); left > 0; --left) { // Cantor's, in three dimensions
         Vector3d p = Vector3d::Zero();
         double size = 1;
         for (int level = 0; level < 12; ++level, size /= 3)
           p += size * Vector3d(double(random.index(2)), double(random.index(2)), double(random.index(2)));
         add(cloud, p, random.direction());
       }
     }},
    {"few points",
     [](Cloud& cloud, Random& random) {
       for (std::size_t left = random.index(13); left > 0; --left)
         add(cloud, random.inCube(), random.direction());
     }},
    {"identical points",
     [](Cloud& cloud, Random& random) {
       const Vector3d at = random.inCube(), normal = random.direction();
       for (std::size_t left = 100000; left > 0; --left)
         add(cloud, at, normal);
       if (random.oneIn(2))
         addSphere(cloud, count(random), at, 1, random);
     }},
    {"repeated points",
     [](Cloud& cloud, Random& random) {
       sphere(cloud, random);
       const Cloud once = cloud;
       for (std::size_t left = 1 + random.index(10); left > 0; --left)
         for (std::size_t n = 0; n < once.positions.size(); ++n)
           add(cloud, once.positions[n], random.oneIn(4) ? random.direction() : once.normals[n]);
     }},
    // One half of the sphere a thousand times as dense.
    {"uneven density",
     [](Cloud& cloud, Random& random) {
       for (int left = 2000; left > 0; --left) {
         Vector3d normal = random.direction();
         normal.z() = random.oneIn(1000) ? -std::abs(normal.z()) : std::abs(normal.z());
         add(cloud, normal, normal);
       }
     }},
    // Lines of a scanner: far apart beside the distances along them.
    {"lines",
     [](Cloud& cloud, Random& random) {
       const std::size_t rows = 2 + random.index(20), columns = 20 + random.index(150);
       for (std::size_t row = 0; row < rows; ++row)
         for (std::size_t column = 0; column < columns; ++column) {
           const double u = static_cast<double>(row) / static_cast<double>(rows),
                        v = static_cast<double>(column) / static_cast<double>(columns);
           add(cloud, {v, u, .2 * std::sin(3 * u + 5 * v)}, Vector3d::UnitZ());
         }
     }},
    // What a camera of distances sees: steps in depth, and pixels without a distance.
    {"range image",
     [](Cloud& cloud, Random& random) {
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
     }},
    {"anisotropic",
     [](Cloud& cloud, Random& random) {
       const Vector3d factors(random.decades(-3, 3), random.decades(-3, 3), 1);
       sphere(cloud, random);
       changeAll(cloud, [&](Vector3d& p, Vector3d& n) {
         p = p.cwiseProduct(factors).eval();
         n = n.cwiseQuotient(factors).normalized().eval();
       });
     }},
    {"outliers",
     [](Cloud& cloud, Random& random) {
       sphere(cloud, random);
       for (std::size_t left = 1 + random.index(10); left > 0; --left)
         add(cloud, random.decades(0, 8) * random.direction(), random.direction());
     }},
    {"huge scale", [](Cloud& cloud, Random& random) { scaledBy(6, 38, cloud, random); }},
    {"tiny scale",
     [](Cloud& cloud, Random& random) {
       scaledBy(-46, -6, cloud, random); // down to denormal numbers and zero
     }},
    {"huge offset",
     [](Cloud& cloud, Random& random) {
       const Vector3d offset = random.decades(3, 30) * random.direction();
       sphere(cloud, random);
       changeAll(cloud, [&](Vector3d& p, Vector3d&) { p += offset; });
     }},
    {"not finite",
     [](Cloud& cloud, Random& random) {
       const double values[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                                -std::numeric_limits<double>::infinity(), 1e308};
       sphere(cloud, random);
       changeAll(cloud, [&](Vector3d& p, Vector3d& n) {
         if (random.oneIn(4))
           (random.oneIn(2) ? p : n)[static_cast<Eigen::Index>(random.index(3))] = values[random.index(4)];
       });
     }},
    {"zero normals",
     [](Cloud& cloud, Random& random) {
       const std::size_t one = random.oneIn(2) ? 1 : 1 + random.index(10);
       sphere(cloud, random);
       changeAll(cloud, [&](Vector3d&, Vector3d& n) {
         if (random.oneIn(one))
           n.setZero();
       });
     }},
    {"equal normals",
     [](Cloud& cloud, Random& random) {
       const Vector3d normal = random.direction();
       sphere(cloud, random);
       changeAll(cloud, [&](Vector3d&, Vector3d& n) { n = normal; });
     }},
    {"random normals",
     [](Cloud& cloud, Random& random) {
       sphere(cloud, random);
       changeAll(cloud, [&](Vector3d&, Vector3d& n) { n = random.decades(-30, 30) * random.direction(); });
     }},
    {"flipped normals",
     [](Cloud& cloud, Random& random) {
       const bool all = random.oneIn(2);
       sphere(cloud, random);
       changeAll(cloud, [&](Vector3d&, Vector3d& n) { n *= all || random.oneIn(2) ? -1 : 1; });
     }},
};

/// A cloud of the kind, some with sensors, confidences, or without normals.
Cloud drawCloud(const Kind& kind, Random& random)
{
  Cloud cloud;
  kind.make(cloud, random);
  cloud.kind = kind.name;
  if (random.oneIn(4))
    cloud.normals.clear();
  if (random.oneIn(6))
    addSensors(cloud, random);
  if (random.oneIn(10))
    for (std::size_t n = 0; n < cloud.positions.size(); ++n)
      cloud.confidences.push_back(static_cast<float>(random.uniform(-.1, 1.1)));
  return cloud;
}

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The usual range of an option's random values, and the ends that are tried now and then.
struct Drawn {
  double lower, upper, least, most;
};

Drawn limitsOf(const OptionDeclaration& option)
{
  // What takes long, or says little, over most of its range.
  static const std::map<std::string, Drawn> narrower = {{"remesher.rounds", {0, 12, 0, 50}},
                                                        {"uncertainty.samples", {2, 6, 2, 8}},
                                                        {"uncertainty.surfaces", {0, 2, 0, 3}},
                                                        {"threads", {1, 4, 1, 4}},
                                                        {"multiscale.maxMemory", {1, 1000, 1, 1e12}},
                                                        {"multiscale.denseVoxels", {0, 1e5, 0, 1e15}},
                                                        {"multiscale.padding", {2, 20, 2, 100}},
                                                        {"observation.neighbors", {1, 20, 1, 100}},
                                                        {"trimming.minComponentPoints", {0, 100, 0, 1e6}}};
  const auto own = narrower.find(option.name);
  if (own != narrower.end())
    return own->second;
  const double usual = option.get(Options()), lower = option.range.lower,
               upper = std::min(option.range.upper, usual > 0 ? 5 * usual : 100.);
  return {lower, upper, lower, std::min<double>(option.range.upper, std::numeric_limits<float>::max())};
}

double drawNumber(const OptionDeclaration& option, Random& random, double unit)
{
  if (option.unit == "length" || option.unit == "sigma") // around the points' spacing, now and then any length at all
    return random.oneIn(20) ? random.decades(-45, 38) : unit * random.decades(-1, 2);
  const Drawn drawn = limitsOf(option);
  double value = random.uniform(drawn.lower, drawn.upper);
  if (random.oneIn(10))
    value = random.oneIn(2) ? drawn.least : drawn.most;
  if (option.range.lowerOpen && value <= option.range.lower)
    value = std::nextafter(option.range.lower, infinity);
  if (option.range.upperOpen && value >= option.range.upper)
    value = .999999 * option.range.upper;
  return option.isWhole ? std::round(value) : value;
}

/// Draws the value of one option; keeps the old one if the drawn value is refused.
void change(const OptionDeclaration& option, Options& options, Random& random, double unit, std::string& description)
{
  const double value =
      option.isNumber() ? drawNumber(option, random, unit) : option.words[random.index(option.words.size())].second;
  if (option.accepts(value) && option.set(options, value))
    description += " " + option.name + "=" + option.textOf(value);
}

/// The approximate distance between neighbors on a surface through the cloud.
double unitOf(const Cloud& cloud)
{
  Eigen::AlignedBox3d box;
  for (const Vector3d& position : cloud.positions)
    if (position.allFinite())
      box.extend(position);
  const double size = box.diagonal().norm();
  return std::isfinite(size) && size > 0 ? size / std::sqrt(static_cast<double>(cloud.positions.size())) : 1;
}

/// Options that are valid for the lengths of the cloud, mostly near the defaults, now and then at the ends of the
/// ranges. \param description the differences from the defaults are appended
Options drawOptions(const Cloud& cloud, Random& random, std::string& description)
{
  Options options;
  if (random.oneIn(10)) {
    options = paperPreset();
    description += " preset=paper";
  }
  options.threads = 2;
  // Most clouds say nothing about most of a volume this large, and would take as long as a hundred others.
  options.multiscale.maxMemory = std::size_t{1} << 27;
  const double unit = unitOf(cloud);
  constexpr std::size_t most = 8;
  const auto& table = optionDeclarations();
  for (std::size_t left = random.oneIn(4) ? 0 : 1 + random.index(most); left > 0; --left)
    change(table[random.index(table.size())], options, random, unit, description);
  // These solve everywhere and slowly: seconds for what takes multigrid in bands milliseconds.
  if ((options.solver.method != SolverMethod::multigrid || options.prior.energy == Energy::paper) &&
      options.multiscale.voxelSize < 4 * unit && !random.oneIn(20)) {
    options.multiscale.voxelSize = static_cast<float>(std::min(4 * unit, 1e30));
    description += " multiscale.voxelSize=" + decimalText(options.multiscale.voxelSize);
  }
  return options;
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool isSanitized = true; // addresses are reserved by the terabyte
#else
constexpr bool isSanitized = false;
#endif
// A run on fewer than 100,000 points that takes a minute of processor time counts as hanging.
constexpr double secondsLimit = isSanitized ? 600 : 60;
constexpr rlim_t bytesLimit = rlim_t{2} << 30;

/// The beginnings of the two valid answers of a case.
constexpr const char *meshPrefix = "mesh", *errorPrefix = "error";

float toFloat(double value)
{
  constexpr double largest = std::numeric_limits<float>::max();
  if (std::abs(value) > largest)
    return value < 0 ? -std::numeric_limits<float>::infinity() : std::numeric_limits<float>::infinity();
  return static_cast<float>(value);
}

Eigen::Vector3f toFloat(const Eigen::Vector3d& v)
{
  return {toFloat(v.x()), toFloat(v.y()), toFloat(v.z())};
}

template <typename PointT>
typename pcl::PointCloud<PointT>::Ptr makeCloud(const Cloud& cloud)
{
  typename pcl::PointCloud<PointT>::Ptr result(new pcl::PointCloud<PointT>);
  for (std::size_t n = 0; n < cloud.positions.size(); ++n) {
    PointT point;
    point.getVector3fMap() = toFloat(cloud.positions[n]);
    if constexpr (pcl::traits::has_normal<PointT>::value) {
      if (!cloud.normals.empty())
        point.getNormalVector3fMap() = toFloat(cloud.normals[n]);
      if (!cloud.confidences.empty())
        point.curvature = cloud.confidences[n];
    }
    if constexpr (pcl::traits::has_color<PointT>::value)
      point.r = static_cast<std::uint8_t>(n % 256);
    result->push_back(point);
  }
  return result;
}

/// The fault of a mesh; empty if it has none.
std::string faultOf(const TriangleMesh& mesh)
{
  std::ostringstream text;
  if (mesh.triangles.empty())
    return "no triangles";
  for (const auto& triangle : mesh.triangles)
    for (const auto vertex : triangle)
      if (vertex < 0 || static_cast<std::size_t>(vertex) >= mesh.vertices.size())
        return "an index out of range";
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!mesh.vertices[v].allFinite())
      return "a vertex that is not finite";
    if (!(std::abs(mesh.normals.at(v).norm() - 1) < 1e-3f)) // they are normalized in single precision
      text << "a normal of length " << mesh.normals[v].norm() << "; ";
    if (!(mesh.confidences.at(v) >= 0 && mesh.confidences[v] <= 1))
      text << "a confidence of " << mesh.confidences[v] << "; ";
    if (!text.str().empty())
      return text.str();
  }
  const MeshStatistics statistics = measure(mesh);
  if (!statistics.manifold())
    text << statistics.nonManifoldEdges << " edges and " << statistics.nonManifoldVertices
         << " vertices that are not manifold; ";
  if (statistics.unusedVertices > 0)
    text << statistics.unusedVertices << " vertices without a triangle; ";
  return text.str();
}

/// The fault in how a run failed; empty if there is none.
std::string faultOf(const Report& report, const pcl::PolygonMesh& mesh)
{
  const bool isExpected = report.status == Status::invalidInput || report.status == Status::invalidOption ||
                          report.status == Status::resourceLimit || report.status == Status::solverFailure;
  if (!isExpected)
    return std::string("it ended with ") + toString(report.status) + ": " + report.message;
  if (!mesh.polygons.empty() || !mesh.cloud.data.empty())
    return "a mesh in spite of an error";
  if (report.message.size() < 20 || report.message.find('\n') != std::string::npos)
    return "a message that is not one clear line: '" + report.message + "'";
  if (report.message.find("nan") != std::string::npos)
    return "a message about nothing: '" + report.message + "'";
  return {};
}

/// Runs a cloud as a user does. \return how it ended, or the fault
template <typename PointT>
std::string runAs(const Cloud& cloud, Options options, bool again)
{
  pcl::MRFReconstruction<PointT> mrf;
  mrf.setOptions(options);
  mrf.setInputCloud(makeCloud<PointT>(cloud));
  mrf.setSensorPositions(cloud.sensors, cloud.views);
  pcl::PolygonMesh output;
  mrf.reconstruct(output);
  const Report report = mrf.getReport();
  const std::string fault = report.status == Status::ok ? faultOf(conversion::plain(output)) : faultOf(report, output);
  if (!fault.empty())
    return fault;
  const TriangleMesh mesh = conversion::plain(output);
  if (again) {
    options.threads = options.threads == 1 ? 3 : 1;
    mrf.setOptions(options);
    pcl::PolygonMesh other;
    mrf.reconstruct(other);
    // What is free differs from run to run, and messages about it say how much.
    const bool isSameEnd = mrf.getReport().status == report.status &&
                           (report.status == Status::resourceLimit || mrf.getReport().message == report.message);
    if (!isSameEnd || !conversion::sameBytes(conversion::plain(other), mesh))
      return "another result with another number of threads: " + mrf.getReport().message;
  }
  if (report.status != Status::ok)
    return std::string(errorPrefix) + " " + toString(report.status) + ": " + report.message;
  std::ostringstream text;
  text << meshPrefix << ' ' << mesh.triangles.size() << " triangles, " << selfIntersectingTriangles(mesh).size()
       << " intersect";
  return text.str();
}

/// A case, drawn by its seed.
struct Case {
  std::uint64_t seed;
  Cloud cloud;
  Options options;
  std::string description;
  bool again; ///< also with another number of threads

  explicit Case(std::uint64_t number) : seed(number)
  {
    Random random(seed * 7919 + 15);
    cloud = drawCloud(kinds[seed % kinds.size()], random);
    std::ostringstream text;
    text << "seed " << seed << ", " << cloud.kind << ", " << cloud.positions.size() << " points"
         << (cloud.normals.empty() ? "" : ", normals");
    if (!cloud.sensors.empty())
      text << ", " << cloud.sensors.size() << " sensors" << (cloud.views.empty() ? "" : " and views");
    text << (cloud.confidences.empty() ? "" : ", confidences") << ", options:";
    description = text.str();
    options = drawOptions(cloud, random, description);
    if (!cloud.confidences.empty())
      options.confidenceField = "curvature";
    again = random.oneIn(5);
    // Without normals the type may still have room for them, and they are zero.
    hasRoomForNormals_ = !cloud.normals.empty() || !cloud.confidences.empty() || random.oneIn(3) ||
                         options.normals.source == NormalSource::use ||
                         options.normals.source == NormalSource::reference;
  }

  std::string run() const
  {
    return hasRoomForNormals_ ? runAs<pcl::PointXYZRGBNormal>(cloud, options, again)
                              : runAs<pcl::PointXYZ>(cloud, options, again);
  }

private:
  bool hasRoomForNormals_;
};

} // namespace

int main(int argc, char** argv)
{
  const std::uint64_t cases = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : isSanitized ? 20 : 200;
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 0;
  if (argc > 3 || cases == 0) {
    std::fprintf(stderr, "usage: test_random_clouds [CASES [FIRST_SEED]]\n");
    return 2;
  }
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS); // errors are expected
  if (const rlimit memory{bytesLimit, bytesLimit}; !isSanitized)
    setrlimit(RLIMIT_AS, &memory);
  std::uint64_t failures = 0, meshes = 0;
  for (std::uint64_t seed = first; seed < first + cases; ++seed) {
    const Case drawn(seed);
    std::printf("%s\n", drawn.description.c_str());
    std::fflush(stdout);
    const std::clock_t before = std::clock();
    const std::string answer = drawn.run();
    const auto seconds = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
    const bool isMesh = answer.rfind(meshPrefix, 0) == 0, isError = answer.rfind(errorPrefix, 0) == 0;
    const bool isGood = (isMesh || isError) && seconds < secondsLimit;
    meshes += isMesh ? 1 : 0;
    failures += isGood ? 0 : 1;
    std::printf("%s %s, %.1f s\n", isGood ? " " : "  FAILED:", answer.c_str(), seconds);
  }
  std::printf("%llu cases: %llu meshes, %llu failures\n", static_cast<unsigned long long>(cases),
              static_cast<unsigned long long>(meshes), static_cast<unsigned long long>(failures));
  return failures == 0 ? 0 : 1;
}

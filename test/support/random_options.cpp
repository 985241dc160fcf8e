// SPDX-License-Identifier: BSD-3-Clause
// The options that random clouds are run with.
#include "support/random_clouds.h"

#include <pcl/surface/mrf/options.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
#include <type_traits>

namespace random_clouds {
namespace {

using namespace pcl::mrf;

/// Draws a value of one option. \return the value as text
struct Change {
  const char* name;
  std::function<std::string(Options& options, Random& random, double unit)> draw;
};

template <typename Value>
std::string text(Value value)
{
  std::ostringstream out;
  out.precision(9);
  out << value;
  return out.str();
}

template <typename Stage>
Change toggle(const char* name, Stage Options::*stage, bool Stage::*member)
{
  return {name, [=](Options& options, Random&, double) {
            bool& value = options.*stage.*member;
            value = !value;
            return text(value ? "on" : "off");
          }};
}

template <typename Stage, typename Enum>
Change choice(const char* name, Stage Options::*stage, Enum Stage::*member, int first, int last)
{
  return {name, [=](Options& options, Random& random, double) {
            const int value = first + static_cast<int>(random.index(static_cast<std::size_t>(last - first + 1)));
            options.*stage.*member = static_cast<Enum>(value);
            return text(value);
          }};
}

/// In [lower, upper], now and then the ends of what is allowed.
template <typename Stage, typename Value>
Change number(const char* name, Stage Options::*stage, Value Stage::*member, double lower, double upper, double least,
              double most)
{
  return {name, [=](Options& options, Random& random, double) {
            double value = random.uniform(lower, upper);
            if (random.oneIn(10))
              value = random.oneIn(2) ? least : most;
            if (std::is_integral<Value>::value)
              value = std::round(value);
            options.*stage.*member = static_cast<Value>(value);
            return text(options.*stage.*member);
          }};
}

/// A length around the points' spacing, now and then any length at all.
template <typename Stage>
Change length(const char* name, Stage Options::*stage, float Stage::*member, double lowerPower = -1,
              double upperPower = 1.5)
{
  return {name, [=](Options& options, Random& random, double unit) {
            double value = unit * random.decades(lowerPower, upperPower);
            if (random.oneIn(20))
              value = random.decades(-45, 38);
            // A number that is none is no option, and neither is what single precision cannot tell from infinity.
            constexpr double largest = std::numeric_limits<float>::max();
            options.*stage.*member = static_cast<float>(std::isfinite(value) ? std::min(value, largest) : 0);
            return text(options.*stage.*member);
          }};
}

const std::vector<Change>& changes()
{
  const auto outliers = &Options::outliers;
  const auto normals = &Options::normals;
  const auto orientation = &Options::orientation;
  const auto observation = &Options::observation;
  const auto prior = &Options::prior;
  const auto solver = &Options::solver;
  const auto multiscale = &Options::multiscale;
  const auto polygonizer = &Options::polygonizer;
  const auto trimming = &Options::trimming;
  const auto remesher = &Options::remesher;
  constexpr double most = std::numeric_limits<int>::max(), huge = std::numeric_limits<float>::max();
  static const std::vector<Change> all = {
      {"unit",
       [](Options& o, Random&, double) {
         o.unit = LengthUnit::nearest;
         return text("nearest");
       }},
      {"search",
       [](Options& o, Random&, double) {
         o.search = SearchKind::kdTree;
         return text("kdtree");
       }},
      toggle("alone", outliers, &OutlierOptions::alone),
      number("aloneFactor", outliers, &OutlierOptions::aloneFactor, 1.1, 5, 1.0001, huge),
      toggle("spacing", outliers, &OutlierOptions::spacing),
      number("spacingNeighbors", outliers, &OutlierOptions::spacingNeighbors, 1, 30, 1, 1000),
      number("spacingFactor", outliers, &OutlierOptions::spacingFactor, 1.1, 5, 1.0001, huge),
      toggle("statistical", outliers, &OutlierOptions::statistical),
      number("statisticalNeighbors", outliers, &OutlierOptions::statisticalNeighbors, 1, 30, 1, 1000),
      number("statisticalDeviations", outliers, &OutlierOptions::statisticalDeviations, .5, 5, 1e-30, huge),
      toggle("robust", outliers, &OutlierOptions::robust),
      choice("source", normals, &NormalOptions::source, 0, 3),
      length("radius", normals, &NormalOptions::radius),
      toggle("noiseCriteria", normals, &NormalOptions::noiseCriteria),
      number("maxThirdEigenvalue", normals, &NormalOptions::maxThirdEigenvalue, .01, .3, 1e-30, 1. / 3),
      length("maxPlaneDistance", normals, &NormalOptions::maxPlaneDistance),
      length("neighborDistance", orientation, &OrientationOptions::neighborDistance),
      toggle("localDistance", orientation, &OrientationOptions::localDistance),
      number("maxAngle", orientation, &OrientationOptions::maxAngle, 5, 60, 1e-30, 90),
      toggle("joinAcrossCreases", orientation, &OrientationOptions::joinAcrossCreases),
      number("minComponentShare", orientation, &OrientationOptions::minComponentShare, 0, .1, 0, .9999),
      toggle("sensorOrigin", orientation, &OrientationOptions::sensorOrigin),
      choice("estimate", observation, &ObservationOptions::kind, 0, 5),
      choice("estimate", observation, &ObservationOptions::kind, 1, 5),
      length("smoothing", observation, &ObservationOptions::smoothing),
      length("noise", observation, &ObservationOptions::noise, -2, 1),
      number("gradientWeight", observation, &ObservationOptions::gradientWeight, .1, 10, 1e-30, 100),
      number("neighbors", observation, &ObservationOptions::neighbors, 1, 20, 1, 100),
      toggle("scaleWithLevel", observation, &ObservationOptions::scaleWithLevel),
      length("maxDistance", observation, &ObservationOptions::maxDistance),
      choice("confidenceShape", observation, &ObservationOptions::confidenceShape, 0, 1),
      choice("prior", prior, &PriorOptions::kind, 1, 3),
      number("beta", prior, &PriorOptions::beta, .1, .999, 0, 1 - 1e-7),
      choice("energy", prior, &PriorOptions::energy, 0, 1),
      choice("method", solver, &SolverOptions::method, 0, 4),
      number("maxIterations", solver, &SolverOptions::maxIterations, 1, 50, 1, most),
      number("residualTolerance", solver, &SolverOptions::residualTolerance, 1e-8, .1, 1e-300, .999999),
      number("changeTolerance", solver, &SolverOptions::changeTolerance, 1e-4, .1, 0, 1e300),
      number("smootherDegree", solver, &SolverOptions::smootherDegree, 1, 10, 0, 50),
      {"choleskyOnCoarsest",
       [](Options& o, Random&, double) {
         o.solver.choleskyOnCoarsest = true;
         return text(true);
       }},
      number("seed", solver, &SolverOptions::seed, 0, 100, 0, 1e19),
      choice("quality", multiscale, &MultiscaleOptions::quality, 0, 2),
      length("voxelSize", multiscale, &MultiscaleOptions::voxelSize, -.5, 1),
      number("padding", multiscale, &MultiscaleOptions::padding, 2, 20, 2, 100),
      number("coarsestSide", multiscale, &MultiscaleOptions::coarsestSide, 4, 64, 4, 256),
      number("maxMemory", multiscale, &MultiscaleOptions::maxMemory, 1e6, 1e9, 1, 1e19),
      number("denseVoxels", multiscale, &MultiscaleOptions::denseVoxels, 0, 1e5, 0, 1e18),
      choice("interpolation", multiscale, &MultiscaleOptions::interpolation, 0, 1),
      choice("decomposition", polygonizer, &PolygonizerOptions::decomposition, 0, 1),
      choice("trimming", trimming, &TrimmingOptions::kind, 0, 2),
      length("maxHole", trimming, &TrimmingOptions::maxHole, -1, 3),
      length("maxGap", trimming, &TrimmingOptions::maxGap, -1, 3),
      number("minComponentPoints", trimming, &TrimmingOptions::minComponentPoints, 0, 100, 0, 1000000),
      number("trimming.minComponentShare", trimming, &TrimmingOptions::minComponentShare, 0, .2, 0, .9999),
      number("rounds", remesher, &RemesherOptions::rounds, 0, 12, 0, 50), // a thousand would take a minute indeed
      length("targetEdge", remesher, &RemesherOptions::targetEdge, -.5, 1.5),
      number("relaxation", remesher, &RemesherOptions::relaxation, .1, 1, 1e-30, 1),
      toggle("fit", remesher, &RemesherOptions::fit),
      number("samples", &Options::uncertainty, &UncertaintyOptions::samples, 2, 6, 2, 1000),
      {"uncertainty.compute",
       [](Options& o, Random& random, double) {
         o.uncertainty.compute = random.index(2) == 1;
         o.uncertainty.surfaces = o.uncertainty.compute ? static_cast<int>(random.index(3)) : 0; // they bring sigma with them
         return text(static_cast<int>(o.uncertainty.compute));
       }},
      {"colors",
       [](Options& o, Random& random, double) {
         o.colors = static_cast<ColorMode>(random.index(4));
         return text(static_cast<int>(o.colors));
       }},
      {"threads",
       [](Options& o, Random& random, double) {
         o.threads = 1 + static_cast<int>(random.index(4));
         return text(o.threads);
       }}};
  return all;
}

/// About the distance between neighbors on a surface through the cloud.
double unitOf(const Cloud& cloud)
{
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), upper = -lower;
  for (const Eigen::Vector3d& position : cloud.positions)
    if (position.allFinite()) {
      lower = lower.cwiseMin(position);
      upper = upper.cwiseMax(position);
    }
  const double size = (upper - lower).norm();
  return std::isfinite(size) && size > 0 ? size / std::sqrt(static_cast<double>(cloud.positions.size())) : 1;
}

} // namespace

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
  for (std::size_t left = random.oneIn(4) ? 0 : 1 + random.index(most); left > 0; --left) {
    const Change& change = changes()[random.index(changes().size())];
    description += std::string(" ") + change.name + "=" + change.draw(options, random, unit);
  }
  // These solve everywhere and slowly: seconds for what takes multigrid in bands milliseconds.
  if ((options.solver.method != SolverMethod::multigrid || options.prior.energy == Energy::paper) &&
      options.multiscale.voxelSize < 4 * unit && !random.oneIn(20)) {
    options.multiscale.voxelSize = static_cast<float>(std::min(4 * unit, 1e30));
    description += " voxelSize=" + text(options.multiscale.voxelSize);
  }
  return options;
}

} // namespace random_clouds

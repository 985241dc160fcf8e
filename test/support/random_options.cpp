// SPDX-License-Identifier: BSD-3-Clause
// The options that random clouds are run with: any of the table, mostly near the defaults.
#include "support/random_clouds.h"

#include <pcl/surface/mrf/option_table.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace random_clouds {
namespace {

using namespace pcl::mrf;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// Where most values are drawn from, and where the ends are that are tried now and then.
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

/// Draws one option; leaves it where it is if it cannot be what was drawn.
void change(const OptionDeclaration& option, Options& options, Random& random, double unit, std::string& description)
{
  const double value =
      option.isNumber() ? drawNumber(option, random, unit) : option.words[random.index(option.words.size())].second;
  if (option.accepts(value) && option.set(options, value))
    description += " " + option.name + "=" + option.textOf(value);
}

/// About the distance between neighbors on a surface through the cloud.
double unitOf(const Cloud& cloud)
{
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(infinity), upper = -lower;
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

} // namespace random_clouds

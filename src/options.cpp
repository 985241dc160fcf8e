#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/options.h>

#include <type_traits>

namespace pcl {
namespace mrf {
namespace {

/// Enumerations may hold anything: they come from casts, or from memory that was never set.
template <typename Enum>
void checkEnum(const char* name, Enum value, Enum last)
{
  const auto number = static_cast<std::underlying_type_t<Enum>>(value);
  if (number < 0 || number > static_cast<std::underlying_type_t<Enum>>(last))
    throw InvalidOption(std::string(name) + " = " + std::to_string(number) + " is none of its named values");
}

} // namespace

Options defaultPreset()
{
  return {};
}

Options paperPreset()
{
  Options options;
  options.unit = LengthUnit::nearest;
  options.outliers.alone = false;
  options.normals.source = NormalSource::estimate;
  options.normals.noiseCriteria = true;
  options.orientation.joinAcrossCreases = false;
  options.orientation.localDistance = false;
  options.orientation.minComponentShare = .01f;
  options.observation.estimate = Estimate::median;
  options.observation.confidenceShape = ConfidenceShape::linear;
  options.prior.prior = Prior::thinPlate;
  options.prior.beta = .9f;
  options.solver.method = SolverMethod::icm;
  options.solver.changeTolerance = 1e-3;
  options.multiscale.padding = 5;
  options.multiscale.interpolation = Interpolation::linear;
  options.trimming.trimming = Trimming::none;
  options.trimming.minComponentShare = .01f; // should trimming be asked for
  options.remesher.rounds = 10;
  return options;
}

void validate(const Options& options)
{
  checkEnum("unit", options.unit, LengthUnit::nearest);
  checkEnum("normals.source", options.normals.source, NormalSource::estimate);
  checkEnum("observation.estimate", options.observation.estimate, Estimate::trapezoid);
  checkEnum("observation.confidenceShape", options.observation.confidenceShape, ConfidenceShape::quadratic);
  checkEnum("multiscale.quality", options.multiscale.quality, Quality::fine);
  checkEnum("multiscale.interpolation", options.multiscale.interpolation, Interpolation::linear);
  checkEnum("polygonizer.decomposition", options.polygonizer.decomposition, CellDecomposition::tetrahedra);
  checkEnum("trimming.trimming", options.trimming.trimming, Trimming::supported);
  checkEnum("colours", options.colours, ColourMode::confidence);
  validate(options.outliers);
  validate(options.normals);
  validate(options.orientation);
  validate(options.observation);
  validate(options.prior);
  validate(options.solver);
  validate(options.multiscale);
  validate(options.remesher);
  validate(options.trimming);
  if (options.threads < 0 || options.threads > 1024)
    throw InvalidOption("threads = " + std::to_string(options.threads) +
                        " is outside its range 0..1024 (0 = one per hardware thread)");
}

} // namespace mrf
} // namespace pcl

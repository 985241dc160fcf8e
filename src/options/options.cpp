// SPDX-License-Identifier: BSD-3-Clause
#include "options/noise_law.h"
#include "options/validation.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/option_table.h>
#include <pcl/surface/mrf/options.h>

#include <optional>

namespace pcl::mrf {
namespace {

/// Checks a member that is not in the option table.
void requireRange(const char* name, double value, const OptionRange& range)
{
  if (!range.contains(value))
    throw InvalidOption(std::string(name) + " = " + decimalText(value) + " is outside its range " + range.text());
}

template <typename Enum>
void requireOneOf(const char* name, Enum value, const Names<Enum>& words)
{
  std::string all;
  for (const auto& [word, known] : words) {
    if (known == value)
      return;
    all += (all.empty() ? "" : ", ") + word;
  }
  throw InvalidOption(std::string(name) + " = " + std::to_string(static_cast<int>(value)) + " is none of " + all);
}

/// Refuses a noise model that is given twice or has no effect.
void requireOneNoise(const ObservationOptions& options)
{
  const std::optional<NoiseLaw> law = noiseLaw(options.noiseModel);
  const std::string model = "observation.noiseModel = " + options.noiseModel;
  if (options.noiseModel != "automatic" && !options.atPoints())
    throw InvalidOption(model + " has a meaning with observation.kind = points only");
  if (law && options.noise > 0)
    throw InvalidOption(model + " and observation.noise = " + decimalText(static_cast<double>(options.noise)) +
                        " both tell the noise; give one of them");
  if (law && !law->isByRange() && options.smoothing > 0)
    throw InvalidOption(model + " would change nothing beside observation.smoothing = " +
                        decimalText(static_cast<double>(options.smoothing)) + "; give one of them");
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
  options.search = SearchKind::kdTree;
  options.outliers.alone = false;
  options.normals.source = NormalSource::estimate;
  options.normals.noiseCriteria = true;
  options.orientation.joinAcrossCreases = false;
  options.orientation.localDistance = false;
  options.orientation.minComponentShare = .01f;
  options.observation.kind = ObservationKind::median;
  options.observation.confidenceShape = ConfidenceShape::linear;
  options.prior.kind = Prior::thinPlate;
  options.prior.beta = .9f;
  options.solver.method = SolverMethod::icm;
  options.solver.changeTolerance = 1e-3;
  options.solver.choleskyOnCoarsest = true;
  options.multiscale.interpolation = Interpolation::linear;
  options.trimming.kind = Trimming::none;
  options.remesher.rounds = 10;
  options.remesher.fit = false;
  return options;
}

Options presetOptions(Preset preset)
{
  return preset == Preset::paper ? paperPreset() : defaultPreset();
}

void requireRanges(const Options& options)
{
  for (const OptionDeclaration& option : optionDeclarations())
    if (const double value = option.get(options); !option.accepts(value))
      throw InvalidOption(option.name + " = " + decimalText(value) + " is " + option.refusal());
  requireRange("orientation.neighborDistance", options.orientation.neighborDistance, {});
  requireRange("orientation.minComponentShare", options.orientation.minComponentShare, {0, 1, false, true});
  requireOneOf("observation.confidenceShape", options.observation.confidenceShape,
               {{"linear", ConfidenceShape::linear}, {"quadratic", ConfidenceShape::quadratic}});
  noiseLaw(options.observation.noiseModel);
  requireRange("solver.residualTolerance", options.solver.residualTolerance, {0, 1, true, true});
  requireRange("solver.smootherDegree", options.solver.smootherDegree, {0, 50});
  requireOneOf("multiscale.interpolation", options.multiscale.interpolation,
               {{"cubic", Interpolation::cubic}, {"linear", Interpolation::linear}});
}

void validate(const Options& options)
{
  requireRanges(options);
  requireOneNoise(options.observation);
  if (options.trimming.watertight && options.uncertainty.maxError > 0)
    throw InvalidOption("trimming.watertight closes what uncertainty.maxError = " +
                        decimalText(options.uncertainty.maxError) + " opens: give one of them");
  if (!options.noiseField.empty() && !options.observation.atPoints())
    throw InvalidOption("noiseField = '" + options.noiseField + "' has a meaning with observation.kind = points only");
  if (wantsUncertainty(options) && !options.observation.atPoints())
    throw InvalidOption(
        "uncertainty.compute, and what needs sigma as well (uncertainty.surfaces, uncertainty.maxError, "
        "colors = sigma), need observation.kind = points, where each point speaks once: what voxels "
        "observe is made of the same points again and again");
}

} // namespace pcl::mrf

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/options.h>

namespace pcl {
namespace mrf {

Options defaultPreset()
{
  return {};
}

Options paperPreset()
{
  Options options;
  options.unit = LengthUnit::nearest;
  options.outliers.alone = false;
  options.outliers.statistical = true;
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
  options.solver.choleskyOnCoarsest = hasCholesky();
  options.trimming.trimming = Trimming::none;
  options.trimming.minComponentShare = .01f; // should trimming be asked for
  options.remesher.rounds = 10;
  return options;
}

void validate(const Options& options)
{
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

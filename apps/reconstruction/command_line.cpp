#include "command_line.h"

#include "option_parser.h"
#include "support/errors.h"
#include "support/parse.h"
#include "support/point_table.h"
#include "support/sensors.h"
#include "support/surface_mesh.h"
#include "support/text_file.h"

#include <array>
#include <charconv>

namespace mrf_apps {
namespace {

using namespace pcl::mrf;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double mebibyte = 1024. * 1024.;
const Range length{0, infinity};
const Range positive{0, infinity, true};

Range wholeNumbers(int lower, int upper)
{
  return {static_cast<double>(lower), static_cast<double>(upper)};
}

// Each registers one group of the help, in the order of the stages.

void addInputOptions(OptionParser& parser, Command& command)
{
  parser.group("Normals and sensors");
  parser.choice("--normals", field(&Options::normals, &NormalOptions::source),
                "normals of the input: use them if there are any, use, take as reference for the orientation, or "
                "estimate anew");
  parser.number("--normal-radius", "LENGTH", length, field(&Options::normals, &NormalOptions::radius),
                "neighbourhood of the plane fit",
                "the 13 nearest points, more where they are rough or lie on a line, or by --noise");
  CLI::Option* sensor = parser
                            .add("--sensor", "X,Y,Z", "position of a sensor, which normals are turned to; repeatable",
                                 [&command](const std::string& text) {
                                   Eigen::Vector3d position;
                                   if (!parseSensor(text, position))
                                     throw CLI::ValidationError("--sensor", "'" + text + "' is not X,Y,Z");
                                   command.sensors.push_back(position);
                                 })
                            ->trigger_on_parse()
                            ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  CLI::Option* sensors = parser.text("--sensors", "FILE", command.sensorsFile, "sensor positions, x y z per line");
  sensors->excludes(sensor);
  parser
      .text("--views", "FILE", command.viewsFile,
            "the sensor, from 0, that saw each point: one number per line; "
            "without it the nearest")
      ->needs(sensors);
  parser.onOff("--sensor-origin", field(&Options::orientation, &OrientationOptions::sensorOrigin),
               "without these, the VIEWPOINT of a PCD file is the sensor, if it is not zero or the cloud is organized");
  parser.add("--confidence-field", "NAME", "field of the input with the confidence of each point, 0 to 1; default none",
             [&command](const std::string& name) { command.options.confidenceField = name; });
}

void addPreprocessingOptions(OptionParser& parser)
{
  parser.group("Outliers");
  parser.onOff("--alone-filter", field(&Options::outliers, &OutlierOptions::alone),
               "drop points that are far from their neighbours and on no surface with them");
  parser.number("--alone-factor", "FACTOR", {1, infinity, true},
                field(&Options::outliers, &OutlierOptions::aloneFactor),
                "so many times as far as the neighbours from theirs");
  parser.onOff("--spacing-filter", field(&Options::outliers, &OutlierOptions::spacing),
               "drop points whose mean distance to their neighbours is a multiple of its median");
  parser.number("--spacing-neighbours", "N", wholeNumbers(1, 1000),
                field(&Options::outliers, &OutlierOptions::spacingNeighbours), "its number of neighbours");
  parser.number("--spacing-factor", "FACTOR", {1, infinity, true},
                field(&Options::outliers, &OutlierOptions::spacingFactor), "its multiple of the median");
  parser.onOff("--statistical-filter", field(&Options::outliers, &OutlierOptions::statistical),
               "PCL's statistical outlier removal");
  parser.number("--statistical-neighbours", "N", wholeNumbers(1, 1000),
                field(&Options::outliers, &OutlierOptions::statisticalNeighbours), "its number of neighbours");
  parser.number("--statistical-deviations", "N", positive,
                field(&Options::outliers, &OutlierOptions::statisticalDeviations), "its limit in standard deviations");
  parser.flag("--robust", "drop points that a robust coarse field cannot agree with: for clusters of false matches",
              [](Options& o) { o.outliers.robust = true; });
  parser.onOff("--noise-criteria", field(&Options::normals, &NormalOptions::noiseCriteria),
               "drop points off the plane fitted for their normal, as the paper does");
  parser.number("--noise-eigenvalue", "SHARE", {0, 1. / 3, true},
                field(&Options::normals, &NormalOptions::maxThirdEigenvalue),
                "its limit to the share of the smallest eigenvalue");
  parser.number("--noise-distance", "LENGTH", length, field(&Options::normals, &NormalOptions::maxPlaneDistance),
                "its limit to the distance from the plane", "s");

  parser.group("Orientation");
  parser.number("--orientation-distance", "LENGTH", length,
                field(&Options::orientation, &OrientationOptions::neighbourDistance),
                "points closer than this are neighbours", "by --local-distance");
  parser.onOff("--local-distance", field(&Options::orientation, &OrientationOptions::localDistance),
               "or, without a length, than five times their own spacing; off: s + 6 standard deviations, at least "
               "2.5 s, for all");
  parser.number("--orientation-angle", "DEGREES", {0, 90, true},
                field(&Options::orientation, &OrientationOptions::maxAngle), "and their normals within this angle");
  parser.onOff("--join-creases", field(&Options::orientation, &OrientationOptions::joinAcrossCreases),
               "join components over neighbours that fail the angle");
  parser.number("--min-component", "SHARE", {0, 1, false, true},
                field(&Options::orientation, &OrientationOptions::minComponentShare),
                "drop components with a smaller share of the points");
  parser.number("--low-agreement", "SHARE", {0, 1}, field(&Options::orientation, &OrientationOptions::lowAgreement),
                "warn if fewer normals agree with the vote on their orientation");
}

/// The change that --smoothing stands for.
std::function<void(Options&)> smoothingLength(const std::string& text)
{
  double value = 0;
  if (text != "auto" && (!toNumber(text, value) || !positive.contains(value) || !isStorable<float>(value, positive)))
    throw CLI::ValidationError("--smoothing", "'" + text + "' is neither auto nor a number " + positive.text());
  return [value](Options& options) { options.observation.smoothing = static_cast<float>(value); };
}

void addModelOptions(OptionParser& parser)
{
  parser.group("Observation");
  parser.choice("--observation", field(&Options::observation, &ObservationOptions::estimate),
                "where the field is observed: at the points, or at voxels by the tangent planes of the nearest points");
  CLI::Option* smoothing = parser.add("--smoothing", "LENGTH|auto",
                                      "what is smaller is smoothed away, > 0; default auto: chosen by the data",
                                      [&parser](const std::string& text) { parser.change(smoothingLength(text)); });
  parser
      .number("--noise", "SIGMA", positive, field(&Options::observation, &ObservationOptions::noise),
              "standard deviation of the scanner's noise; sets the smoothing", "unknown")
      ->excludes(smoothing);
  parser.number("--gradient-weight", "RATIO", {0, 100},
                field(&Options::observation, &ObservationOptions::gradientWeight),
                "of the normals beside the positions, in squared smoothing lengths",
                ".4, or 4 if the data of a noisy cloud say so");
  parser.number("--neighbours", "N", wholeNumbers(1, 100),
                field(&Options::observation, &ObservationOptions::neighbours), "points observed per voxel");
  parser.number("--max-distance", "LENGTH", length, field(&Options::observation, &ObservationOptions::maxDistance),
                "distance from the points at which the confidence reaches 0",
                "3.25 s; 3 s with median, mean and nearest");
  parser.onOff("--scale-distance", field(&Options::observation, &ObservationOptions::scaleWithLevel),
               "coarse levels, and the default distance, reach at least 1.5 voxels");
  parser.choice("--confidence-shape", field(&Options::observation, &ObservationOptions::confidenceShape),
                "how the confidence falls with the distance");

  parser.group("Prior");
  parser.choice("--prior", field(&Options::prior, &PriorOptions::prior),
                "what a surface without data looks like; the first is the flattest and fastest");
  parser.number("--beta", "WEIGHT", {0, 1, false, true}, field(&Options::prior, &PriorOptions::beta),
                "weight of the data observed at voxels; lower it for noisy data");
  parser.choice("--energy", field(&Options::prior, &PriorOptions::energy),
                "joint: Eq. 9 of the paper, and its program; weighted: Eq. 10-11; paper-text: Eq. 6 as its text weighs "
                "the data, 36/7 (thin-plate) or 18 (triharmonic) against 42 or 324");

  parser.group("Grid");
  CLI::Option* quality = parser.choice("--quality", field(&Options::multiscale, &MultiscaleOptions::quality),
                                       "voxel side of the finest level: 3 s, 2 s or 1.5 s");
  parser
      .number("--voxel-size", "LENGTH", length, field(&Options::multiscale, &MultiscaleOptions::voxelSize),
              "the same as a length", "by the quality")
      ->excludes(quality);
  parser.choice("--unit", field(&Options::unit),
                "s, the unit of automatic lengths: half the side of the square that a point stands for, or the mean "
                "distance to the nearest point (the paper's)");
  parser.number("--padding", "VOXELS", wholeNumbers(2, 100), field(&Options::multiscale, &MultiscaleOptions::padding),
                "voxels of the finest level around the points", "6, more beside openings");
  parser.number("--coarsest-side", "VOXELS", wholeNumbers(4, 256),
                field(&Options::multiscale, &MultiscaleOptions::coarsestSide),
                "levels are added until the longest side is at most this");
  parser.number("--max-memory", "MIB", length, field(&Options::multiscale, &MultiscaleOptions::maxMemory),
                "memory the levels may take", "80 % of what is free", mebibyte);
  parser.number("--dense-voxels", "N", wholeNumbers(0, 2000000000),
                field(&Options::multiscale, &MultiscaleOptions::denseVoxels),
                "levels of more voxels are solved near the surface only");
  parser.choice("--interpolation", field(&Options::multiscale, &MultiscaleOptions::interpolation),
                "of a level's field, for what the next finer one starts from; near the surface only always cubic");

  parser.group("Solver");
  parser.choice("--solver", field(&Options::solver, &SolverOptions::method), "how the linear system is solved");
  parser.number("--max-iterations", "N", wholeNumbers(0, 1000000000),
                field(&Options::solver, &SolverOptions::maxIterations), "iterations or sweeps per level",
                "100 (multigrid; near the surface only 4, 2, 1), 1000 (icm), 10000 (cg)");
  parser.number("--residual-tolerance", "RATIO", {0, 1, true, true},
                field(&Options::solver, &SolverOptions::residualTolerance),
                "multigrid and cg stop at this relative residual");
  parser.number("--change-tolerance", "VOXELS", length, field(&Options::solver, &SolverOptions::changeTolerance),
                "icm and multigrid stop when a step changes less (RMS), 8 times that where points are observed; "
                "0 = never");
  parser.number("--smoother-degree", "N", wholeNumbers(0, 50), field(&Options::solver, &SolverOptions::smootherDegree),
                "of multigrid's Chebyshev smoother",
                "2, 5, 10 by the order of the prior, near the surface only 2, 4, 5");
  parser.onOff("--cholesky-coarsest", field(&Options::solver, &SolverOptions::choleskyOnCoarsest),
               "factorise the coarsest level whatever the solver");
  parser.number("--max-factor-memory", "MIB", positive, field(&Options::solver, &SolverOptions::maxFactorBytes),
                "memory a Cholesky factor may take", {}, mebibyte);
  parser.number("--seed", "N", {0, 9e15}, field(&Options::solver, &SolverOptions::seed), "of icm's visiting order");
}

void addMeshOptions(OptionParser& parser)
{
  parser.group("Mesh");
  parser.choice("--polygonizer", field(&Options::polygonizer, &PolygonizerOptions::decomposition),
                "how the zero level is cut out of the voxels");
  CLI::Option* remesh = parser.number("--remesh", "N", wholeNumbers(0, 1000),
                                      field(&Options::remesher, &RemesherOptions::rounds), "rounds of remeshing");
  parser.flag("--no-remesh", "the same as --remesh 0", [](Options& o) { o.remesher.rounds = 0; })->excludes(remesh);
  parser.number("--target-edge", "LENGTH", length, field(&Options::remesher, &RemesherOptions::targetEdge),
                "edge that the remesher aims at", "median edge before");
  parser.number("--relaxation", "SHARE", {0, 1, true}, field(&Options::remesher, &RemesherOptions::relaxation),
                "of the remesher's tangential step that is taken");
  parser.choice("--trim", field(&Options::trimming, &TrimmingOptions::trimming),
                "invented surface: keep all, keep only fillings of holes, or keep none");
  parser.number("--max-hole", "LENGTH", length, field(&Options::trimming, &TrimmingOptions::maxHole),
                "largest diameter of a hole that is filled", "half the bounding box's diagonal");
  parser.number("--max-gap", "LENGTH", length, field(&Options::trimming, &TrimmingOptions::maxGap),
                "the same for holes and bays of a surface that is open elsewhere",
                "--max-hole if given, or 24 % of the diagonal, but 28 local spacings across steps in depth");
  parser.number(
      "--trim-points", "N", wholeNumbers(0, 1000000), field(&Options::trimming, &TrimmingOptions::minComponentPoints),
      "drop components of the mesh with fewer coherent points behind them (three are enough where no other surface is "
      "near), but never the largest; not with --trim none");
  parser.number("--trim-component", "SHARE", {0, 1, false, true},
                field(&Options::trimming, &TrimmingOptions::minComponentShare),
                "the same for those with less of the supported area");
  parser.choice("--colour", field(&Options::colours),
                "colours of the mesh: blue where interpolated and skin where observed, the input's, or none");
}

void addOutputOptions(OptionParser& parser, Command& command)
{
  parser.group("More output");
  parser.text("--report", "FILE.json", command.report, "all parameters, counts, times and statistics");
  parser.text(
      "--field", "FILE.vti", command.field,
      "the distance field, and the confidence of observed voxels; of a cloud in pieces far apart also FILE.2.vti, "
      "FILE.3.vti ...");
  parser.text("--picture", "FILE.png", command.picture, "a rendering of the mesh; needs an X display (xvfb-run)");
  parser.group("Run");
  parser.number("--threads", "N", wholeNumbers(0, 1024), field(&Options::threads), "the result does not depend on it",
                "one per hardware thread");
}

void requireExtension(const std::string& option, const std::string& path, const std::string& wanted)
{
  if (!path.empty() && extension(path) != wanted)
    throw UsageError(option + ": '" + path + "' does not end in ." + wanted);
}

void check(const Command& command, bool maxHoleGiven)
{
  const std::string input = extension(command.input);
  if (input != "pcd" && input != "ply" && input != "obj" && input != "xyz" && input != "txt")
    throw UsageError("INPUT '" + command.input + "' does not end in " + pointFileExtensions);
  if (!isMeshFormat(extension(command.output)))
    throw UsageError("OUTPUT '" + command.output + "' does not end in " + meshFileExtensions);
  requireExtension("--report", command.report, "json");
  requireExtension("--field", command.field, "vti");
  requireExtension("--picture", command.picture, "png");
  if (maxHoleGiven && command.options.trimming.trimming != pcl::mrf::Trimming::holes)
    throw UsageError("--max-hole has a meaning with --trim holes only");
}

} // namespace

std::string decimal(double value)
{
  std::array<char, 32> digits;
  // The defaults are floats; as doubles they would show the digits that float lacks.
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), static_cast<float>(value));
  return {digits.data(), end.ptr};
}

std::string Range::text() const
{
  if (std::isinf(upper))
    return (lowerOpen ? "> " : ">= ") + decimal(lower);
  return (lowerOpen ? "(" : "[") + decimal(lower) + ", " + decimal(upper) + (upperOpen ? ")" : "]");
}

Command parseCommandLine(int argc, const char* const* argv)
{
  Command command;
  CLI::App app("Reconstructs a surface from points by a Markov random field of signed distances (Paulsen et al. 2010).",
               "pcl_mrf_reconstruction");
  app.get_formatter()->column_width(34);
  app.footer("s is the sampling distance of the points, see --unit. Lengths are in "
             "the unit of INPUT.\nExit status: 0 done, 1 a file cannot be read or written or holds nothing to "
             "reconstruct, 2 wrong usage, 3 the method failed.");
  app.add_option("INPUT", command.input,
                 std::string("points, or a mesh whose vertices are the points: ") + pointFileExtensions)
      ->required();
  app.add_option("OUTPUT", command.output, std::string("mesh: ") + meshFileExtensions)->required();

  OptionParser parser(app);
  std::string preset = "default";
  parser.group("Preset");
  parser.add("--preset", "default|paper", "settings that the other options change; default: as shown here",
             [&preset](const std::string& text) {
               if (text != "default" && text != "paper")
                 throw CLI::ValidationError("--preset", "'" + text + "' is none of default, paper");
               preset = text;
             });
  addInputOptions(parser, command);
  addPreprocessingOptions(parser);
  addModelOptions(parser);
  addMeshOptions(parser);
  addOutputOptions(parser, command);
  const auto given = [&app](const std::string& name) { return app.get_option(name)->count() > 0; };
  const CLI::Option* verbose = app.add_flag("-v,--verbose", "print all there is to know")->group("Run");
  const CLI::Option* quiet =
      app.add_flag("-q,--quiet", "print errors only")->group("Run")->excludes(app.get_option("--verbose"));
  app.set_help_flag("-h,--help", "print this help")->group("Run");

  command.information = parse(app, argc, argv, "pcl_mrf_reconstruction " MRF_VERSION);
  if (!command.information.empty())
    return command;
  const std::string confidenceField = command.options.confidenceField;
  command.options = preset == "paper" ? pcl::mrf::paperPreset() : pcl::mrf::defaultPreset();
  parser.apply(command.options);
  command.options.confidenceField = confidenceField;
  command.verbosity = quiet->count() > 0     ? Verbosity::quiet
                      : verbose->count() > 0 ? Verbosity::verbose
                                             : Verbosity::normal;
  check(command, given("--max-hole"));
  const bool atPoints = command.options.observation.atPoints();
  for (const char* name : {"--smoothing", "--noise", "--gradient-weight"})
    if (!atPoints && given(name))
      throw UsageError(std::string(name) + " has a meaning with --observation points only");
  for (const char* name : {"--beta", "--energy", "--neighbours", "--scale-distance"})
    if (atPoints && given(name))
      throw UsageError(std::string(name) + " has no meaning with --observation points; choose another one");
  return command;
}

} // namespace mrf_apps

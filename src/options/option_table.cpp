// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/option_table.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <stdexcept>
#include <type_traits>

namespace pcl::mrf {

const NamesOfAll& namesOfAll()
{
  static const NamesOfAll all(
      {{"density", LengthUnit::density}, {"nearest", LengthUnit::nearest}},
      {{"bins", SearchKind::bins}, {"kdtree", SearchKind::kdTree}},
      {{"membrane", Prior::membrane}, {"thin-plate", Prior::thinPlate}, {"triharmonic", Prior::triharmonic}},
      {{"joint", Energy::joint}, {"paper", Energy::paper}},
      {{"points", ObservationKind::points},
       {"median", ObservationKind::median},
       {"mean", ObservationKind::mean},
       {"nearest", ObservationKind::nearest},
       {"plane", ObservationKind::plane},
       {"trapezoid", ObservationKind::trapezoid}},
      {{"draft", Quality::draft}, {"normal", Quality::normal}, {"fine", Quality::fine}},
      {{"multigrid", SolverMethod::multigrid},
       {"icm", SolverMethod::icm},
       {"icm-colors", SolverMethod::icmColors},
       {"cg", SolverMethod::cg},
       {"cholesky", SolverMethod::cholesky}},
      {{"auto", NormalSource::automatic},
       {"use", NormalSource::use},
       {"reference", NormalSource::reference},
       {"estimate", NormalSource::estimate}},
      {{"none", OrientationVote::none},
       {"reference", OrientationVote::reference},
       {"sensor", OrientationVote::sensor},
       {"outward", OrientationVote::outward}},
      {{"none", Trimming::none}, {"holes", Trimming::holes}, {"supported", Trimming::supported}},
      {{"confidence", ColorMode::confidence},
       {"sigma", ColorMode::sigma},
       {"input", ColorMode::input},
       {"none", ColorMode::none}},
      {{"default", Preset::standard}, {"paper", Preset::paper}});
  return all;
}

std::string decimalText(double value)
{
  std::array<char, 32> digits;
  // Most options are floats; as doubles they would show digits that a float does not have.
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), static_cast<float>(value));
  return {digits.data(), end.ptr};
}

bool OptionRange::contains(double value) const
{
  return std::isfinite(value) && (lowerOpen ? value > lower : value >= lower) &&
         (upperOpen ? value < upper : value <= upper);
}

std::string OptionRange::text() const
{
  if (std::isinf(upper))
    return (lowerOpen ? "> " : ">= ") + decimalText(lower);
  constexpr float third = 1.f / 3;
  const std::string end = static_cast<float>(upper) == third ? "1/3" : decimalText(upper);
  return (lowerOpen ? "(" : "[") + decimalText(lower) + ", " + end + (upperOpen ? ")" : "]");
}

bool OptionDeclaration::accepts(double value) const
{
  if (!isNumber())
    return std::any_of(words.begin(), words.end(), [&](const auto& word) { return word.second == value; });
  return (value == 0 && !automatic.empty()) || (range.contains(value) && (!isWhole || value == std::floor(value)));
}

std::string OptionDeclaration::refusal() const
{
  if (isNumber())
    return "outside its range " + range.text() + (unit == "degrees" || unit == "voxels" ? " " + unit : "") +
           (automatic.empty() ? "" : " (0 = " + automatic + ")");
  std::string text = "none of ";
  for (const auto& entry : words)
    text += (&entry == &words.front() ? "" : ", ") + entry.first;
  return text;
}

std::string OptionDeclaration::textOf(double value) const
{
  for (const auto& [word, number] : words)
    if (number == value)
      return word;
  return decimalText(value);
}

std::string OptionDeclaration::defaultText() const
{
  const double value = get(defaultPreset());
  return value == 0 && !automatic.empty() ? automatic : textOf(value);
}

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double mebibyte = 1024. * 1024.;
const OptionRange notNegative{0, infinity};
const OptionRange zeroToBelowOne{0, 1, false, true};

/// Converts a number to the largest type of its kind.
template <typename Value>
OptionValue widened(Value value)
{
  if constexpr (std::is_floating_point_v<Value>)
    return static_cast<double>(value);
  else if constexpr (std::is_signed_v<Value>)
    return static_cast<std::int64_t>(value);
  else
    return static_cast<std::uint64_t>(value);
}

/// Adds rows to the table for the members of one struct. \tparam Stage the struct; Options: its own members
template <typename Stage>
class Rows {
public:
  /// \param prefix prefix of the options' names
  Rows(std::vector<OptionDeclaration>& rows, const char* prefix, Stage Options::*stage = nullptr)
      : rows_(rows), prefix_(prefix), stage_(stage)
  {}

  /// \param factor the option's unit in units of the member, such as bytes per MiB
  template <typename Value>
  void number(const char* name, const char* flag, const char* unit, const OptionRange& range, Value Stage::*field,
              const char* help, const char* automatic = "", double factor = 1)
  {
    const auto member = accessTo(field);
    OptionDeclaration& row = add(name, flag, help);
    row.unit = unit;
    row.range = range;
    row.isWhole = std::is_integral_v<Value> && factor == 1;
    row.automatic = automatic;
    row.get = [member, factor](const Options& options) { return static_cast<double>(member(options)) / factor; };
    row.exact = [member](const Options& options) -> OptionValue { return widened(member(options)); };
    row.set = [member, factor, range](Options& options, double value) {
      const double number = value * factor;
      constexpr double largestWhole = 0x1p53; // above it, a double is not exactly the typed number
      if (std::is_integral_v<Value> && number > largestWhole)
        return false;
      if (!(number < static_cast<double>(std::numeric_limits<Value>::max())))
        return false;
      const double stored = static_cast<double>(static_cast<Value>(number)) / factor;
      if ((range.lowerOpen && value != 0 && stored <= range.lower) || (range.upperOpen && stored >= range.upper))
        return false;
      member(options) = static_cast<Value>(number);
      return true;
    };
  }

  template <typename Value>
  void choice(const char* name, const char* flag, Value Stage::*field, const char* help)
  {
    const auto member = accessTo(field);
    OptionDeclaration& row = add(name, flag, help);
    for (const auto& [word, value] : names<Value>())
      row.words.emplace_back(word, static_cast<double>(static_cast<std::underlying_type_t<Value>>(value)));
    // Uninitialized memory may hold any number in an enumeration, so it is read as a number.
    row.get = [member](const Options& options) {
      return static_cast<double>(static_cast<std::underlying_type_t<Value>>(member(options)));
    };
    row.exact = [member](const Options& options) -> OptionValue { return nameOf(member(options)); };
    row.set = [member](Options& options, double value) {
      member(options) = static_cast<Value>(static_cast<std::underlying_type_t<Value>>(value));
      return true;
    };
  }

  void onOff(const char* name, const char* flag, bool Stage::*field, const char* help)
  {
    const auto member = accessTo(field);
    OptionDeclaration& row = add(name, flag, help);
    row.words = {{"on", 1}, {"off", 0}};
    row.get = [member](const Options& options) { return member(options) ? 1. : 0.; };
    row.exact = [member](const Options& options) -> OptionValue { return member(options); };
    row.set = [member](Options& options, double value) {
      member(options) = value != 0;
      return true;
    };
  }

private:
  template <typename Value>
  auto accessTo(Value Stage::*field) const
  {
    if constexpr (std::is_same_v<Stage, Options>)
      return [field](auto& options) -> decltype(auto) { return (options.*field); };
    else
      return [stage = stage_, field](auto& options) -> decltype(auto) { return (options.*stage.*field); };
  }

  OptionDeclaration& add(const char* name, const char* flag, const char* help)
  {
    OptionDeclaration& row = rows_.emplace_back();
    row.name = std::string(prefix_) + name;
    row.flag = flag;
    row.help = help;
    return row;
  }

  std::vector<OptionDeclaration>& rows_;
  const char* prefix_;
  Stage Options::*stage_;
};

void declareInput(std::vector<OptionDeclaration>& rows)
{
  Rows<OutlierOptions> outliers(rows, "outliers.", &Options::outliers);
  outliers.onOff("alone", "--alone-filter", &OutlierOptions::alone,
                 "drop points that are far from their neighbors and on no surface with them, between two that their "
                 "sensor saw, or "
                 "seen through by other sensors");
  outliers.onOff("statistical", "--statistical-filter", &OutlierOptions::statistical,
                 "PCL's statistical outlier removal: 8 neighbors, 3 standard deviations");
  outliers.onOff("robust", "--robust", &OutlierOptions::robust,
                 "drop points that a robust coarse field cannot agree with: for clusters of false matches");
  Rows<NormalOptions> normals(rows, "normals.", &Options::normals);
  normals.choice("source", "--normals", &NormalOptions::source,
                 "normals of the input: use them if there are any, use, take as reference for the orientation, or "
                 "estimate anew");
  normals.number("radius", "--normal-radius", "length", notNegative, &NormalOptions::radius,
                 "neighborhood of the plane fit",
                 "the 13 nearest points, more where they are rough or lie on a line, or by --noise");
  normals.onOff("noiseCriteria", "--noise-criteria", &NormalOptions::noiseCriteria,
                "drop points off the plane fitted for their normal, as the paper does");
  Rows<OrientationOptions> orientation(rows, "orientation.", &Options::orientation);
  orientation.number("maxAngle", "--orientation-angle", "degrees", {0, 90, true}, &OrientationOptions::maxAngle,
                     "neighbors belong together if their normals are within this angle");
  orientation.onOff(
      "sensorOrigin", "--sensor-origin", &OrientationOptions::sensorOrigin,
      "if no sensor is given, the VIEWPOINT of a PCD file is the sensor, if it is not zero or the "
      "cloud is organized, and the scanners of a PTX file are; to tell what was seen through, so is the origin "
      "if all normals look there");
}

void declareField(std::vector<OptionDeclaration>& rows)
{
  Rows<ObservationOptions> observation(rows, "observation.", &Options::observation);
  observation.choice(
      "kind", "--observation", &ObservationOptions::kind,
      "where the field is observed: at the points, or at voxels by the tangent planes of the nearest points");
  observation.number("smoothing", "--smoothing", "length", notNegative, &ObservationOptions::smoothing,
                     "details smaller than this are smoothed away", "chosen by the data");
  observation.number("noise", "--noise", "sigma", notNegative, &ObservationOptions::noise,
                     "standard deviation of the scanner's noise; sets the smoothing", "unknown");
  observation.number("gradientWeight", "--gradient-weight", "ratio", {0, 100}, &ObservationOptions::gradientWeight,
                     "weight of the normals beside the positions, in squared smoothing lengths",
                     ".4, or 4 if the data of a noisy cloud with normals say so");
  observation.number("neighbors", "--neighbors", "n", {1, 100}, &ObservationOptions::neighbors,
                     "points observed per voxel");
  observation.number("maxDistance", "--max-distance", "length", notNegative, &ObservationOptions::maxDistance,
                     "distance from the points at which the confidence reaches 0",
                     "3.25 s; 3 s with median, mean and nearest");
  Rows<PriorOptions> prior(rows, "prior.", &Options::prior);
  prior.choice("kind", "--prior", &PriorOptions::kind,
               "what a surface without data looks like; the first is the flattest and fastest");
  prior.number("beta", "--beta", "weight", zeroToBelowOne, &PriorOptions::beta,
               "weight of the data observed at voxels; lower it for noisy data");
  prior.choice("energy", "--energy", &PriorOptions::energy,
               "joint: Eq. 9 of the paper, and its program; paper: Eq. 10-11 as they are written, for --solver cg");
  Rows<SolverOptions> solver(rows, "solver.", &Options::solver);
  solver.choice(
      "method", "--solver", &SolverOptions::method,
      "how the linear system is solved; icm-colors visits voxels in parallel that icm visits in random order");
  solver.number("maxIterations", "--max-iterations", "n", notNegative, &SolverOptions::maxIterations,
                "iterations or sweeps per level",
                "100 (multigrid; near the surface only 4, 2, 1), 1000 (icm), 10000 (cg)");
  solver.number("changeTolerance", "--change-tolerance", "voxels", notNegative, &SolverOptions::changeTolerance,
                "icm and multigrid stop when a step changes less (RMS), multigrid at 1.5 times that on whole levels; "
                "0 = never");
  solver.number("seed", "--seed", "n", notNegative, &SolverOptions::seed,
                "seed of icm's visiting order and of the draws of --uncertainty");
  Rows<MultiscaleOptions> multiscale(rows, "multiscale.", &Options::multiscale);
  multiscale.choice("quality", "--quality", &MultiscaleOptions::quality,
                    "voxel side of the finest level: 3, 2 or 1.5 times s, see --unit");
  multiscale.number("voxelSize", "--voxel-size", "length", notNegative, &MultiscaleOptions::voxelSize,
                    "side of the finest voxels", "by the quality");
  multiscale.number("padding", "--padding", "voxels", {2, 100}, &MultiscaleOptions::padding,
                    "voxels of the finest level around the points", "6, more beside openings");
  multiscale.number("maxMemory", "--max-memory", "MiB", notNegative, &MultiscaleOptions::maxMemory,
                    "memory that the run may take, also as 8G", "80 % of what is free", mebibyte);
  multiscale.number("denseVoxels", "--dense-voxels", "n", notNegative, &MultiscaleOptions::denseVoxels,
                    "levels of more voxels are solved near the surface only", "1048576, less for few points");
}

void declareMesh(std::vector<OptionDeclaration>& rows)
{
  Rows<RemesherOptions> remesher(rows, "remesher.", &Options::remesher);
  remesher.number("rounds", "--remesh", "n", {0, 1000}, &RemesherOptions::rounds, "rounds of remeshing");
  remesher.number("targetEdge", "--target-edge", "length", notNegative, &RemesherOptions::targetEdge,
                  "edge that the remesher aims at, everywhere", "median edge before, longer where points are sparse");
  remesher.number("triangles", "--triangles", "n", {0, 1e8}, &RemesherOptions::triangles,
                  "triangles to end with; 0: as many as the edges ask for");
  Rows<TrimmingOptions> trimming(rows, "trimming.", &Options::trimming);
  trimming.choice("kind", "--trim", &TrimmingOptions::kind,
                  "invented surface: keep all, keep only fillings of holes, or keep none");
  trimming.number("maxHole", "--max-hole", "length", notNegative, &TrimmingOptions::maxHole,
                  "largest diameter of a hole that is filled", "half the bounding box's diagonal");
  trimming.number("maxGap", "--max-gap", "length", notNegative, &TrimmingOptions::maxGap,
                  "largest diameter of a hole or bay that is filled where the surface is open elsewhere",
                  "--max-hole if given, or 24 % of the diagonal, but 28 local spacings behind steps in depth, "
                  "and nothing where a sensor saw through");
  trimming.number(
      "minComponentPoints", "--trim-points", "n", {0, 1000000}, &TrimmingOptions::minComponentPoints,
      "drop components of the mesh with fewer coherent points behind them (three are enough where no other surface is "
      "near), but never the largest; not with --trim none");
  trimming.onOff(
      "watertight", "--watertight", &TrimmingOptions::watertight,
      "close what is left, however wide its openings are, as flat as they allow: for printing, and for volumes");
  Rows<UncertaintyOptions> uncertainty(rows, "uncertainty.", &Options::uncertainty);
  uncertainty.onOff(
      "compute", "--uncertainty", &UncertaintyOptions::compute,
      "fields sigma, the standard deviation of the surface along its normal as a length, and sigma_calibrated, 0 "
      "where it is an extrapolation");
  uncertainty.number("samples", "--samples", "n", {2, 1000}, &UncertaintyOptions::samples,
                     "draws from the posterior that --uncertainty makes, see --seed");
  uncertainty.number(
      "surfaces", "--write-samples", "n", {0, 1000}, &UncertaintyOptions::surfaces,
      "surfaces that sigma allows for, beside OUTPUT as OUTPUT.sample-1, .sample-2 ...: for intervals of "
      "whatever is measured on them; as many draws at least, and --uncertainty, come with it");
  uncertainty.number(
      "maxError", "--max-error", "length", notNegative, &UncertaintyOptions::maxError,
      "drop surface that is farther off than this in more than 5 of 100 cases, as sigma says, on top of what "
      "--trim drops; --uncertainty comes with it",
      "none is dropped");
}

void declareOthers(std::vector<OptionDeclaration>& rows)
{
  Rows<Options> table(rows, "");
  table.choice("unit", "--unit", &Options::unit,
               "s, the unit of automatic lengths: half the side of the square that a point stands for, or the mean "
               "distance to the nearest point (the paper's)");
  table.choice("search", "--search", &Options::search,
               "what finds nearest points: sorted bins, or PCL's kd-tree (FLANN), which takes longer for the same");
  table.choice(
      "colors", "--color", &Options::colors,
      "colors of the mesh: blue where interpolated and skin where observed, by sigma as --uncertainty computes it from "
      "blue to red, the input's, or none");
  table.number("threads", "--threads", "n", {0, 1024}, &Options::threads,
               "threads to run on; the result does not depend on it", "one per hardware thread");
}

/// Sets the names of pcl::MRFReconstruction's setters.
void nameSetters(std::vector<OptionDeclaration>& rows)
{
  static const std::map<std::string, std::string> setters = {{"outliers.robust", "setRobust"},
                                                             {"normals.source", "setNormalSource"},
                                                             {"orientation.sensorOrigin", "setUseSensorOrigin"},
                                                             {"observation.kind", "setObservation"},
                                                             {"observation.smoothing", "setSmoothing"},
                                                             {"observation.noise", "setNoise"},
                                                             {"prior.kind", "setPrior"},
                                                             {"prior.beta", "setBeta"},
                                                             {"solver.method", "setSolver"},
                                                             {"multiscale.quality", "setQuality"},
                                                             {"multiscale.voxelSize", "setVoxelSize"},
                                                             {"remesher.rounds", "setNumberOfRemeshingRounds"},
                                                             {"remesher.targetEdge", "setTargetEdge"},
                                                             {"remesher.triangles", "setTargetTriangles"},
                                                             {"trimming.kind", "setTrimming"},
                                                             {"trimming.maxHole", "setMaxHole"},
                                                             {"trimming.watertight", "setWatertight"},
                                                             {"uncertainty.compute", "setComputeUncertainty"},
                                                             {"uncertainty.surfaces", "setNumberOfSurfaces"},
                                                             {"uncertainty.maxError", "setMaxError"},
                                                             {"colors", "setColorMode"},
                                                             {"threads", "setNumberOfThreads"}};
  for (OptionDeclaration& row : rows)
    if (const auto entry = setters.find(row.name); entry != setters.end())
      row.setter = entry->second;
}

std::vector<OptionDeclaration> declareAll()
{
  std::vector<OptionDeclaration> rows;
  declareInput(rows);
  declareField(rows);
  declareMesh(rows);
  declareOthers(rows);
  nameSetters(rows);
  return rows;
}

/// An option's name in a message, and the value that follows it: "prior.beta = 2".
struct NamedOption {
  std::string name, value;
};

/// Reads the word at a position of a message, and its value. \return the length of both; 0 if no word begins there
std::size_t readOption(const std::string& message, std::size_t at, NamedOption& option)
{
  static const std::string letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.:";
  if (at > 0 && letters.find(message[at - 1]) != std::string::npos)
    return 0;
  std::size_t end = std::min(message.find_first_not_of(letters, at), message.size());
  while (end > at && (message[end - 1] == '.' || message[end - 1] == ':'))
    --end;
  option = {message.substr(at, end - at), {}};
  if (message.compare(end, 3, " = ") == 0) {
    const std::size_t from = end + 3, to = std::min(message.find_first_of(" ,;:)", from), message.size());
    option.value = message.substr(from, to - from);
    end = to;
  }
  return end - at;
}

std::string renamed(const NamedOption& option, const std::string& text, OptionNaming naming)
{
  if (option.name == "RawCloud::sensors")
    return naming == OptionNaming::flags ? "--sensor" : "setSensorPosition";
  if (option.name == "RawCloud::views")
    return naming == OptionNaming::flags ? "--views" : "setSensorPositions";
  // Options that are texts have no rows in the table.
  for (const auto& [name, flag, setter] :
       {std::array<const char*, 3>{"observation.noiseModel", "--noise-model", "setNoiseModel"},
        std::array<const char*, 3>{"noiseField", "--noise-field", "setNoiseField"},
        std::array<const char*, 3>{"confidenceField", "--confidence-field", "setConfidenceField"}})
    if (option.name == name)
      return (naming == OptionNaming::flags ? flag : setter) + (option.value.empty() ? "" : " " + option.value);
  const auto& all = optionDeclarations();
  const auto row = std::find_if(all.begin(), all.end(), [&](const auto& other) { return other.name == option.name; });
  // A word without a dot is an option's name only if a value follows.
  if (row == all.end() || (option.name.find('.') == std::string::npos && option.value.empty()))
    return text;
  if (naming == OptionNaming::flags)
    return row->flag + (option.value.empty() ? "" : " " + option.value);
  if (row->setter.empty())
    return text + (option.value.empty() ? " of setOptions" : "");
  return row->setter + (option.value.empty() ? "" : "(" + option.value + ")");
}

} // namespace

const std::vector<OptionDeclaration>& optionDeclarations()
{
  static const std::vector<OptionDeclaration> all = declareAll();
  return all;
}

const OptionDeclaration& optionDeclaration(const std::string& name)
{
  for (const OptionDeclaration& option : optionDeclarations())
    if (option.name == name)
      return option;
  throw std::out_of_range("there is no option " + name);
}

std::string withOptionNames(const std::string& message, OptionNaming naming)
{
  if (naming == OptionNaming::members)
    return message;
  std::string text;
  for (std::size_t at = 0; at < message.size();) {
    NamedOption option;
    const std::size_t length = std::max<std::size_t>(readOption(message, at, option), 1);
    const std::string said = message.substr(at, length);
    text += option.name.empty() ? said : renamed(option, said, naming);
    at += length;
  }
  return text;
}

} // namespace pcl::mrf

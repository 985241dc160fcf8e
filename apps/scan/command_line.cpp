// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"

#include "analytic_surface.h"
#include "support/errors.h"
#include "support/mesh_reader.h"
#include "support/point_table.h"
#include "support/surface_mesh.h"
#include "support/text_file.h"
#include "support/tool_options.h"

#include <algorithm>

namespace mrf_apps {
namespace {

using namespace pcl::mrf::scan;
using Eigen::Vector3d;

void addLength(ToolOptions& parser, const std::string& name, Length& target, const std::string& help)
{
  parser.add(name, "LENGTH", help, [&target](const std::string& text) {
    return parseLength(text, target) ? "" : "is not a length such as 0.5, 2% or 0.5s";
  });
}

/// "RADIUS" or "LEAST:MOST".
bool parseRadii(const std::string& text, ScanOptions& options)
{
  const std::size_t colon = text.find(':');
  if (!parseLength(text.substr(0, colon), options.smallestHole))
    return false;
  options.largestHole = options.smallestHole;
  return colon == std::string::npos || parseLength(text.substr(colon + 1), options.largestHole);
}

/// "LOWEST:HIGHEST", degrees.
bool parseElevations(const std::string& text, SamplingOptions& options)
{
  const std::size_t colon = std::min(text.find(':'), text.size());
  return colon < text.size() && toNumber(text.substr(0, colon), options.lowestElevation) &&
         toNumber(text.substr(colon + 1), options.highestElevation);
}

/// Ahead of the options that it has defaults for.
void addDeviceOptions(ToolOptions& parser, ScanCommand& command)
{
  ScanOptions& options = command.options;
  parser.group("Device");
  parser.choice<Device>(
      "--device",
      {{"none", Device::none},
       {"depth-camera", Device::depthCamera},
       {"lidar", Device::lidar},
       {"structured-light", Device::structuredLight},
       {"photogrammetry", Device::photogrammetry}},
      [&options](Device device) { adopt(device, options); },
      "what scans, with its errors and defaults. depth-camera: disparities with errors over patches of pixels, "
      "in steps of 1/8 pixel, flying pixels at edges; --sampling camera. lidar: noise along the ray, mixed "
      "pixels where the beam meets two surfaces; --sampling scanner, --noise 0.2s. structured-light: noise over "
      "the cosine of the angle of incidence, nothing at edges; --sampling camera, --noise 0.2s. "
      "photogrammetry: bumps of 4 and 12 spacings, no points where texture is missing; --noise 1s, "
      "--clusters 1. Default none");
  parser.positive("--baseline", "LENGTH", options.baseline, "of a depth camera; default 0.075, in meters");
  parser.positive("--focal-length", "PIXELS", options.sampling.focalLength,
                  "of a camera with 640 x 480 pixels, of which as many are used as points are asked for; default 580");
}

void checkDevice(const ToolOptions& parser, const ScanOptions& options)
{
  requireUsage(!parser.isGiven("--baseline") || options.device == Device::depthCamera,
               "--baseline is of --device depth-camera");
  requireUsage(!parser.isGiven("--focal-length") || options.sampling.pattern == Pattern::camera,
               "--focal-length is of --sampling camera");
}

void addViewOptions(ToolOptions& parser, ScanCommand& command)
{
  ScanOptions& options = command.options;
  ViewOptions& views = options.views;
  parser.group("Views");
  parser.whole("--views", views.count, 0, 10000, "number of sensors; 0: every point is seen, by no sensor; default 12");
  parser.choice<Placement>(
      "--placement", {{"sphere", Placement::sphere}, {"ring", Placement::ring}, {"front", Placement::front}},
      [&views](Placement placement) { views.placement = placement; },
      "where the sensors are around the object; default sphere");
  parser.number("--distance", "D", views.distance,
                "distance of the sensors from the object's middle, in diagonals; default 1.5");
  parser.vector("--axis", views.axis, "of ring and front, and up of a scanner; default 0,1,0");
  parser.vector("--front", views.forward, "direction of the first sensor, the middle of front; default 0,0,1");
  parser.number("--elevation", "DEGREES", views.elevation,
                "angle above the horizon of the sensors of ring and front; default 0");
  parser.number("--fan", "DEGREES", views.fan, "angle that front spans; default 90");
  parser.file("--sensors", "FILE", command.sensorsFile, "use these sensors, x y z per line, instead of --views");
  parser.vectors("--sensor", options.sensors, "use this sensor instead of --views; may be repeated");
  parser.number("--grazing", "DEGREES", options.sampling.grazingLimit,
                "largest angle between normal and line of sight; default 80");
}

void addErrorOptions(ToolOptions& parser, ScanCommand& command)
{
  ScanOptions& options = command.options;
  parser.group("Errors");
  addLength(parser, "--noise", options.noise,
            "standard deviation of each point, along the normal, or along the ray of a device; default 0");
  addLength(parser, "--misalign-shift", options.misalignmentShift,
            "of each view, standard deviation per axis; default 0");
  parser.number("--misalign-angle", "DEGREES", options.misalignmentAngle,
                "of each view about the object's middle, standard deviation per axis; default 0");
  parser.number("--outliers", "PERCENT", options.uniformOutliers,
                "of the output, spread in the bounding box; default 0");
  parser.number("--clusters", "PERCENT", options.clusteredOutliers,
                "of the output, in clusters of 30 before and behind the surface like false stereo matches, 1% wide; "
                "default 0");
}

void addHoleOptions(ToolOptions& parser, ScanCommand& command)
{
  ScanOptions& options = command.options;
  parser.group("Holes");
  parser.whole("--holes", options.holes, 0, 100000, "number of balls cut out around random points; default 0");
  parser.add(
      "--hole-radius", "LENGTH[:LENGTH]", "or a range of radii; default 7%", [&options](const std::string& text) {
        return parseRadii(text, options) ? "" : "is not a length such as 0.5, 2% or 0.5s, or two with a colon between";
      });
  parser.vectors("--hole", options.holeCenters, "center of a ball to cut out; may be repeated");
}

void addOutputOptions(ToolOptions& parser, ScanCommand& command)
{
  parser.group("Output");
  parser.words("--normals", {"exact", "estimated", "none"},
               "estimated: from 16 points, turned to the sensor; default exact", [&command](const std::string& word) {
                 command.hasNormals = word != "none";
                 command.options.areNormalsEstimated = word == "estimated";
               });
  parser.file("--write-views", "FILE", command.views, "sensor of each point, a number from 0 per line");
  parser.file("--write-sensors", "FILE", command.sensors, "position of each sensor, x y z per line");
  parser.file("--write-held-out", "CLOUD", command.heldOut, "points that the holes took away, without errors");
  parser.file("--write-clean", "CLOUD", command.clean, "the inliers of OUTPUT in their order, without errors");
  parser.file("--write-truth", "MESH", command.truth, "the surface itself, seen or not: " + alternatives(meshFormats));
  parser.file("--report", "FILE.json", command.report, "what was done: counts, lengths, holes");
}

void check(const ScanCommand& command)
{
  const std::string wrong = isShape(command.input) ? "" : whyNotReadable(command.input);
  requireUsage(wrong.empty(), "INPUT '" + command.input + "' is no shape and " + wrong);
  const std::pair<const char*, const std::string&> clouds[] = {
      {"OUTPUT", command.output}, {"--write-held-out", command.heldOut}, {"--write-clean", command.clean}};
  for (const auto& [name, path] : clouds)
    requireUsage(path.empty() || isOneOf(extension(path), pointOutputFormats),
                 std::string(name) + " '" + path + "' does not end in " + alternatives(pointOutputFormats));
  requireUsage(command.truth.empty() || isOneOf(extension(command.truth), meshFormats),
               "--write-truth '" + command.truth + "' does not end in " + alternatives(meshFormats));
  const ScanOptions& options = command.options;
  requireUsage(command.heldOut.empty() || options.holes > 0 || !options.holeCenters.empty(),
               "--write-held-out needs holes: --holes or --hole");
  requireUsage(command.sensorsFile.empty() || options.sensors.empty(), "--sensor and --sensors exclude each other");
  if (command.sensorsFile.empty() && options.sensors.empty() && options.views.count == 0) {
    requireUsage(options.sampling.pattern != Pattern::scanner && options.sampling.pattern != Pattern::camera,
                 "--sampling scanner and camera need sensors, but --views is 0");
    requireUsage(command.views.empty() && command.sensors.empty(),
                 "--write-views and --write-sensors need sensors, but --views is 0");
    requireUsage(options.misalignmentAngle == 0 && options.misalignmentShift.value == 0,
                 "misalignment needs sensors, but --views is 0");
  }
}

void addSamplingOptions(ToolOptions& parser, ScanCommand& command)
{
  ScanOptions& options = command.options;
  parser.group("Sampling");
  parser.whole("--points", options.sampling.points, 1, INT32_MAX,
               "on what is seen of the surface, before holes and outliers; default 30000");
  parser.choice<Pattern>(
      "--sampling",
      {{"even", Pattern::even},
       {"random", Pattern::random},
       {"scanner", Pattern::scanner},
       {"camera", Pattern::camera}},
      [&options](Pattern pattern) { options.sampling.pattern = pattern; },
      "even: points keep a distance (Poisson discs); random: uniformly random; both of the same "
      "density everywhere. scanner: first hits of rays on a regular angular grid from each sensor, "
      "so that density falls with distance and angle; about as many points as asked for. camera: "
      "the same on a grid of pixels. Default even");
  parser.number("--aspect", "RATIO", options.sampling.aspect,
                "of a scanner: angle between its rows over that between the rays of a row; a lidar has 5 or more; "
                "default 1");
  parser.add(
      "--elevations", "LOWEST:HIGHEST",
      "of a scanner's rows, degrees; a sensor amid the object is level, one outside aims at its middle; default -90:90",
      [&options](const std::string& text) {
        return parseElevations(text, options.sampling) ? "" : "is not two numbers with a colon between";
      });
  parser.seed(options.seed, "of all random numbers; default 1");
}

/// What the short help lists.
void addEverydayOptions(ToolOptions& parser)
{
  parser.texts.everyday = {{"--points", "how many; default 30000"},
                           {"--device", "what scans, with its errors: lidar, depth-camera ..."},
                           {"--views", "sensors around the object; default 12"},
                           {"--sensor", "or one here; repeatable"},
                           {"--noise", "standard deviation of each point"},
                           {"--outliers", "share of points that are no surface"},
                           {"--holes", "balls cut out around random points"},
                           {"--hole-radius", "their size; default 7%"},
                           {"--write-held-out", "the points that the holes took away"},
                           {"--write-sensors", "the sensors' positions"},
                           {"--seed", "of all random numbers; default 1"},
                           {"--help-all", "all other options, the shapes, and what a LENGTH is"}};
  parser.texts.examples = {"torus:major=2,minor=.5 scan.ply", "truth.ply scan.ply --holes 3 --write-held-out rest.ply",
                           "person scan.ply --device depth-camera --placement ring"};
}

} // namespace

ScanCommand parseScanCommandLine(int argc, const char* const* argv)
{
  ScanCommand command;
  ToolOptions parser("pcl_mrf_scan", MRF_VERSION,
                     "Simulates range scans of a mesh or of an analytic shape: what sensors around it see, with their "
                     "errors.");
  parser.texts.usage = {"[OPTIONS] INPUT OUTPUT"};
  std::vector<std::string> operands;
  parser.operands(operands, 2);
  parser.texts.operands = {{"INPUT", "mesh: " + meshInputExtensions + "; or a shape, e.g. torus:major=2,minor=.5"},
                           {"OUTPUT", "cloud: " + alternatives(pointOutputFormats)}};
  addEverydayOptions(parser);
  addDeviceOptions(parser, command);
  addSamplingOptions(parser, command);
  parser.group("Object");
  parser.vector("--rotate", command.options.rotation,
                "degrees about x, then y, then z, about the origin; default 0,0,0");
  addViewOptions(parser, command);
  addErrorOptions(parser, command);
  addHoleOptions(parser, command);
  addOutputOptions(parser, command);
  parser.group("Run");
  parser.threads(command.threads, "the result does not depend on it; default one per hardware thread");
  parser.flag("-q,--quiet", command.quiet, "print errors only");
  parser.texts.notes = {"LENGTH is a number in the unit of INPUT, in % of the object's diagonal (0.5%) or in mean "
                        "distances between the points (0.5s).",
                        "Shapes, with their defaults:\n" + describeShapes(),
                        "The same options and seed give the same bytes; each kind of error has its own random numbers, "
                        "so that changing one leaves the rest as it is.",
                        "Exit status: 0 done, 1 a file cannot be read or written or nothing is seen, 2 wrong usage, 3 "
                        "the method failed."};

  parser.parse(argc, argv);
  if (operands.size() < 2)
    throw UsageError(operands.empty() ? "INPUT and OUTPUT are missing" : "OUTPUT is missing");
  command.input = operands[0];
  command.output = operands[1];
  checkDevice(parser, command.options);
  check(command);
  return command;
}

} // namespace mrf_apps

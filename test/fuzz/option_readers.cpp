// SPDX-License-Identifier: BSD-3-Clause
#include "evaluate/command_line.h"
#include "fuzz/readers.h"
#include "reconstruction/command_line.h"
#include "scan/command_line.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/option_table.h>
#include <pcl/surface/mrf/options.h>

#include <array>
#include <cmath>
#include <cstring>
#include <sstream>
#include <type_traits>
#include <vector>

namespace fuzz {
namespace {

using namespace pcl::mrf;

/// The pointers that a main function gets.
class Words {
public:
  Words(const char* program, const std::string& lines)
  {
    words_.emplace_back(program);
    std::istringstream text(lines);
    for (std::string word; std::getline(text, word);)
      words_.push_back(word.substr(0, word.find('\0'))); // the system's words end there
    for (const std::string& word : words_)
      pointers_.push_back(word.c_str());
  }
  int count() const { return static_cast<int>(pointers_.size()); }
  const char* const* pointers() const { return pointers_.data(); }

private:
  std::vector<std::string> words_;
  std::vector<const char*> pointers_;
};

/// Calls visit(member) for every number, switch and enumeration of the options.
template <typename Visit>
void forEachMember(Options& o, const Visit& visit)
{
  const auto all = [&](auto&... members) { (visit(members), ...); };
  all(o.unit, o.search, o.colors, o.threads);
  all(o.outliers.alone, o.outliers.statistical, o.outliers.robust);
  all(o.normals.source, o.normals.radius, o.normals.noiseCriteria);
  all(o.orientation.neighborDistance, o.orientation.localDistance, o.orientation.maxAngle,
      o.orientation.joinAcrossCreases, o.orientation.minComponentShare, o.orientation.sensorOrigin);
  all(o.observation.kind, o.observation.smoothing, o.observation.noise, o.observation.gradientWeight,
      o.observation.neighbors, o.observation.maxDistance);
  all(o.prior.kind, o.prior.beta, o.prior.energy);
  all(o.solver.method, o.solver.maxIterations, o.solver.residualTolerance, o.solver.changeTolerance,
      o.solver.smootherDegree, o.solver.choleskyOnCoarsest, o.solver.seed);
  all(o.multiscale.quality, o.multiscale.voxelSize, o.multiscale.padding, o.multiscale.maxMemory,
      o.multiscale.denseVoxels);
  all(o.trimming.kind, o.trimming.maxHole, o.trimming.maxGap, o.trimming.minComponentPoints);
  all(o.remesher.rounds, o.remesher.targetEdge, o.remesher.triangles, o.remesher.fit);
  all(o.uncertainty.compute, o.uncertainty.samples);
}

template <typename Member>
void setBits(Member& member, const char* bits)
{
  if constexpr (std::is_same_v<Member, bool>) // other bits are none
    member = (*bits & 1) != 0;
  else
    std::memcpy(&member, bits, sizeof(Member));
}

/// What any validation must refuse, whatever else it does.
void requireSound(Options options)
{
  forEachMember(options, [](auto member) {
    using Member = decltype(member);
    if constexpr (std::is_floating_point_v<Member>)
      require(std::isfinite(member) && member >= 0, "a number that is none, or below zero, is valid");
    else if constexpr (std::is_enum_v<Member>)
      require(nameOf(member) != "?", "an enumeration without a name is valid");
    else if constexpr (std::is_integral_v<Member> && std::is_signed_v<Member>)
      require(member >= 0, "a number below zero is valid");
  });
}

} // namespace

void readReconstructionCommand(const std::string& lines)
{
  const Words words("pcl_mrf_reconstruction", lines);
  const mrf_apps::Command command = mrf_apps::parseCommandLine(words.count(), words.pointers());
  if (!command.information.empty())
    return;
  require(!command.jobs.empty(), "a command without a job");
  for (const mrf_apps::Job& job : command.jobs)
    require(!job.inputs.empty() && !job.output.empty(), "a job without its files");
  try {
    validate(command.options);
  } catch (const InvalidOption& error) {
    require(false, ("what the command line accepts is not valid: " + error.message()).c_str());
  }
}

void readEvaluationCommand(const std::string& lines)
{
  const Words words("pcl_mrf_evaluate", lines);
  const mrf_apps::EvaluateCommand command = mrf_apps::parseEvaluateCommandLine(words.count(), words.pointers());
  require(!command.information.empty() || !command.mesh.empty(), "a command without its file");
}

void readScanCommand(const std::string& lines)
{
  const Words words("pcl_mrf_scan", lines);
  mrf_apps::parseScanCommandLine(words.count(), words.pointers());
}

void readOptions(const std::string& bytes)
{
  constexpr std::size_t size = 9;
  static_assert(size == 1 + sizeof(double), "the widest member");
  Options options;
  for (std::size_t at = 0; at + size <= bytes.size(); at += size) {
    int left = static_cast<unsigned char>(bytes[at]);
    forEachMember(options, [&](auto& member) {
      if (left-- == 0)
        setBits(member, bytes.data() + at + 1);
    });
  }
  validate(options);
  requireSound(options);
}

} // namespace fuzz

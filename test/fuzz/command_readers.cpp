// SPDX-License-Identifier: BSD-3-Clause
#include "evaluate/command_line.h"
#include "fuzz/readers.h"
#include "reconstruction/command_line.h"
#include "scan/command_line.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/options.h>

#include <sstream>
#include <vector>

namespace fuzz {
namespace {

using namespace pcl::mrf;

/// What a tool parses of lines that are the words of its command line.
template <typename Parse>
auto parsed(const Parse& parse, const char* program, const std::string& lines)
{
  std::vector<std::string> words = {program};
  std::istringstream text(lines);
  for (std::string word; std::getline(text, word);)
    words.push_back(word.substr(0, word.find('\0'))); // the system's words end there
  std::vector<const char*> pointers;
  for (const std::string& word : words)
    pointers.push_back(word.c_str());
  return parse(static_cast<int>(pointers.size()), pointers.data());
}

} // namespace

void readReconstructionCommand(const std::string& lines)
{
  const mrf_apps::Command command = parsed(mrf_apps::parseCommandLine, "pcl_mrf_reconstruction", lines);
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
  const mrf_apps::EvaluateCommand command = parsed(mrf_apps::parseEvaluateCommandLine, "pcl_mrf_evaluate", lines);
  require(!command.mesh.empty(), "a command without its file");
}

void readScanCommand(const std::string& lines)
{
  parsed(mrf_apps::parseScanCommandLine, "pcl_mrf_scan", lines);
}

} // namespace fuzz

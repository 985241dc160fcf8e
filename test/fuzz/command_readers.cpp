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

/// A command line as the pointers that a main function gets.
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

} // namespace fuzz

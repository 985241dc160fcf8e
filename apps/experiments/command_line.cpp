// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"

#include "support/errors.h"
#include "support/suggestion.h"
#include "support/tool_options.h"

#include <algorithm>
#include <sstream>

namespace mrf_apps {
namespace {

std::string list()
{
  std::string text;
  std::size_t width = 0;
  for (const Experiment& experiment : experiments())
    width = std::max(width, experiment.id.size());
  for (const Experiment& experiment : experiments())
    text += experiment.id + std::string(width + 2 - experiment.id.size(), ' ') + experiment.title + "\n";
  return text;
}

void check(const ExperimentsCommand& command)
{
  std::vector<std::string> names;
  for (const Experiment& experiment : experiments())
    names.push_back(experiment.id);
  for (const std::string& id : command.only) {
    const auto has = [&](const Experiment& experiment) { return experiment.id == id; };
    if (std::none_of(experiments().begin(), experiments().end(), has))
      throw UsageError("--only: '" + id + "' is no experiment" + didYouMean(id, names) + "; --list names them");
  }
}

/// Words with commas between, appended.
void addWords(const std::string& text, std::vector<std::string>& words)
{
  std::istringstream stream(text);
  for (std::string word; std::getline(stream, word, ',');)
    words.push_back(word);
}

} // namespace

ExperimentsCommand parseExperimentsCommandLine(int argc, const char* const* argv)
{
  ExperimentsCommand command;
  ExperimentOptions& options = command.options;
  ToolOptions parser("pcl_mrf_experiments", MRF_VERSION,
                     "Repeats the paper's experiments beside other methods, and writes a page, tables and pictures.");
  parser.usage("[OPTIONS] --output FOLDER");
  std::vector<std::string> operands;
  parser.operands(operands, 0);
  parser.group("What is done");
  parser.folder("-o,--output", options.folder, "of the results; made if it is not there");
  parser.flag("--quick", options.quick, "fewer scans and settings, coarser grids: minutes instead of an hour");
  parser.add("--only", "ID,...", "some of the experiments, by the names that --list gives",
             [&](const std::string& text) {
               addWords(text, command.only);
               return command.only.empty() ? "is not the name of an experiment" : "";
             });
  bool isListed = false;
  parser.flag("--list", isListed, "print the experiments' names and titles");
  parser.seed(options.seed, "of all scans; default " + std::to_string(options.seed));
  using pcl::mrf::scan::Pattern;
  parser.choice<Pattern>("--sampling",
                         {{"even", Pattern::even}, {"random", Pattern::random}, {"scanner", Pattern::scanner}},
                         options.sampling, "of the scans of table-1 and defaults, as in pcl_mrf_scan; default even");
  parser.folder(
      "--data", options.data,
      "with further objects to scan: reference/igea.ply, reference/nefertiti.ply; with clouds: real/*/input.ply, "
      "with normals, and beside it heldout.ply, heldout_random.ply, sensors.txt");
  parser.group("Run");
  parser.threads(command.threads, "results do not depend on it, times do; default one per hardware thread");
  bool hasNoPictures = false;
  parser.flag("--no-pictures", hasNoPictures, "needs no X display");
  parser.flag("--fresh", command.fresh, "measure everything again");
  parser.flag("-q,--quiet", command.quiet, "print errors only");
  parser.everyday({{"--output", "of the results"},
                   {"--quick", "minutes instead of an hour"},
                   {"--only", "some of the experiments"},
                   {"--list", "their names and titles"},
                   {"--data", "with further objects and clouds, see --help-all"},
                   {"--no-pictures", "needs no X display"},
                   {"--fresh", "measure everything again"},
                   {"--help-all", "all other options"}});
  parser.examples({"--list", "--output results --quick", "--output results --only fig-2,table-1 --no-pictures"});
  parser.note("FOLDER receives index.html, results.json, a CSV file per table, the pictures, and journal.jsonl, from "
              "which an interrupted run goes on: what it holds for the same seed, --quick and build of the program is "
              "not measured again.");
  parser.note("Exit status: 0 done, 1 a file cannot be read or written, 2 wrong usage, 3 an experiment failed.");

  command.information = parser.parse(argc, argv);
  if (!command.information.empty())
    return command;
  if (isListed) {
    command.information = list();
    return command;
  }
  if (options.folder.empty())
    throw UsageError("--output is required");
  options.hasPictures = !hasNoPictures;
  check(command);
  return command;
}

} // namespace mrf_apps

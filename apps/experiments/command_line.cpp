#include "command_line.h"

#include "support/errors.h"
#include "support/parse.h"
#include "support/word_options.h"

#include <CLI/CLI.hpp>

#include <algorithm>

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
  for (const std::string& id : command.only) {
    const auto has = [&](const Experiment& experiment) { return experiment.id == id; };
    if (std::none_of(experiments().begin(), experiments().end(), has))
      throw UsageError("--only '" + id + "' is no experiment; --list names them");
  }
}

} // namespace

ExperimentsCommand parseExperimentsCommandLine(int argc, const char* const* argv)
{
  ExperimentsCommand command;
  ExperimentOptions& options = command.options;
  CLI::App app("Repeats the paper's experiments beside other methods, and writes a page, tables and pictures.",
               "pcl_mrf_experiments");
  app.get_formatter()->column_width(26);
  app.footer("FOLDER receives index.html, results.json, a CSV file per table, the pictures, and journal.jsonl, from "
             "which an interrupted run goes on: what it holds for the same seed, --quick and build of the program is "
             "not measured again.\nExit status: 0 done, 1 a file cannot be read or written, "
             "2 wrong usage, 3 an experiment failed.");
  WordOptions words(app);
  const char* const folderName = "the name of a folder";
  words.path("-o,--output", "FOLDER", options.folder, "of the results; made if it is not there", folderName);
  app.add_flag("--quick", options.quick, "fewer scans and settings, coarser grids: minutes instead of an hour");
  app.add_option("--only", command.only, "some of the experiments, by the names that --list gives")
      ->delimiter(',')
      ->type_name("ID,...");
  bool isListed = false;
  app.add_flag("--list", isListed, "print the experiments' names and titles");
  words.seed(options.seed, "of all scans; default " + std::to_string(options.seed));
  using pcl::mrf::scan::Pattern;
  words.choice<Pattern>("--sampling",
                        {{"even", Pattern::even}, {"random", Pattern::random}, {"scanner", Pattern::scanner}},
                        options.sampling, "of the scans of table-1 and defaults, as in pcl_mrf_scan; default even");
  words.path(
      "--data", "FOLDER", options.data,
      "with further objects to scan: reference/igea.ply, reference/nefertiti.ply; with clouds: real/*/input.ply, "
      "with normals, and beside it heldout.ply, heldout_random.ply, sensors.txt",
      folderName);
  words.threads(command.threads, "results do not depend on it, times do; default one per hardware thread");
  bool hasNoPictures = false;
  app.add_flag("--no-pictures", hasNoPictures, "needs no X display");
  app.add_flag("--fresh", command.fresh, "measure everything again");
  app.add_flag("-q,--quiet", command.quiet, "print errors only");
  app.set_help_flag("-h,--help", "print this help");

  command.information = parse(app, argc, argv, "pcl_mrf_experiments " MRF_VERSION);
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

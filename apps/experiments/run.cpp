// SPDX-License-Identifier: BSD-3-Clause
#include "run.h"

#include "build_identity.h"
#include "case_display.h"
#include "journal.h"
#include "laboratory.h"
#include "page.h"
#include "support/errors.h"
#include "support/output_files.h"
#include "support/text_file.h"

#include <pcl/pcl_config.h>
#include <pcl/surface/mrf/exceptions.h>

#include <sys/utsname.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

namespace mrf_apps {
namespace {

namespace fs = std::filesystem;

std::string processorName()
{
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.rfind("model name", 0) == 0 && line.find(": ") != std::string::npos)
      return line.substr(line.find(": ") + 2);
  return "not known";
}

std::string date()
{
  const std::time_t now = std::time(nullptr);
  std::array<char, 40> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", std::gmtime(&now));
  return text.data();
}

Facts factsOf(const ExperimentOptions& options, const std::string& build, int threads, const Plan& cases)
{
  utsname system{};
  uname(&system);
  return {{"Program", "pcl_mrf_experiments " MRF_VERSION ", build " + build},
          {"PCL", PCL_VERSION_PRETTY},
          {"Processor", processorName()},
          {"Threads", std::to_string(threads)},
          {"System", std::string(system.sysname) + " " + system.release + " " + system.machine},
          {"Written", date()},
          {"Cases", std::to_string(cases.known + cases.missing) + ", of which " + std::to_string(cases.known) +
                        " were measured by earlier runs"},
          {"Seed", std::to_string(options.seed)},
          {"Extent", options.quick ? "quick: fewer scans and settings, coarser grids" : "full"},
          {"Further objects", options.data.empty() ? "none" : "from --data"}};
}

void requireFolder(const std::string& folder)
{
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    if (fs::exists(folder, error))
      throw FileError(folder, "is not a folder");
    if (!fs::create_directory(folder, error))
      throw FileError(folder, "cannot be made: " + error.message());
  }
}

/// A folder without any of the objects is a mistake: the run would be one without --data, which takes as long.
void requireData(const std::string& folder)
{
  if (!fs::is_directory(folder))
    throw FileError(folder, "is not a folder");
  const fs::path reference = fs::path(folder) / "reference";
  if (!fs::exists(reference / "igea.ply") && !fs::exists(reference / "nefertiti.ply") &&
      !fs::is_directory(fs::path(folder) / "real"))
    throw FileError(folder, "holds neither reference/igea.ply nor reference/nefertiti.ply nor the folder real");
}

/// Finds out before hours of work whether the results can be written.
void requireOutputs(const std::string& folder)
{
  OutputFiles probe;
  for (const char* name : {"index.html", "results.json"})
    probe.add((fs::path(folder) / name).string());
}

void write(const Page& page, const std::string& folder)
{
  OutputFiles outputs;
  const auto write = [&](const std::string& name, const std::string& text) {
    const std::string path = (fs::path(folder) / name).string();
    outputs.add(path);
    outputs.write(path, [&](const std::string& temporary) { writeText(temporary, text); });
  };
  for (const Section& section : page.sections)
    for (const Table& table : section.tables)
      write(table.name + ".csv", toCsv(table));
  write("results.json", toJson(page).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  write("index.html", toHtml(page, folder));
  outputs.publish();
}

/// An experiment that breaks down costs its own section, not the hours of the others.
/// \param failed what went wrong in the first one that did
Section sectionOf(const Experiment& experiment, Laboratory& laboratory, std::string& failed)
{
  const auto broken = [&](const std::string& message) {
    if (failed.empty())
      failed = experiment.id + ": " + message;
    return Section{experiment.id, experiment.title, {"This experiment failed: " + message}, {}, {}, {}};
  };
  try {
    return experiment.run(laboratory);
  } catch (const FileError&) {
    throw;
  } catch (const pcl::mrf::Error& error) {
    return broken(error.message());
  } catch (const std::logic_error& error) {
    return broken(error.what());
  } catch (const std::runtime_error& error) {
    return broken(error.what());
  }
}

std::vector<Experiment> chosen(const std::vector<std::string>& ids)
{
  std::vector<Experiment> result;
  const std::set<std::string> wanted(ids.begin(), ids.end());
  std::copy_if(experiments().begin(), experiments().end(), std::back_inserter(result),
               [&](const Experiment& experiment) { return wanted.empty() || wanted.count(experiment.id) > 0; });
  return result;
}

} // namespace

void run(const ExperimentsCommand& command)
{
  const ExperimentOptions& options = command.options;
  if (!options.data.empty())
    requireData(options.data);
  if (options.hasPictures)
    try {
      requireDisplay();
    } catch (const FileError& error) {
      throw FileError(std::string(error.what()) + ", or ask for --no-pictures");
    }
  requireFolder(options.folder);
  requireOutputs(options.folder);
  const std::string build = identityOf(filesOfBuild());
  Journal journal((fs::path(options.folder) / "journal.jsonl").string(), {options.seed, options.quick, build},
                  command.fresh);

  const std::vector<Experiment> all = chosen(command.only);
  CaseDisplay display(command.quiet);
  Plan cases;
  for (const Experiment& experiment : all) {
    const Plan planned = plan(experiment, options, journal);
    cases.known += planned.known;
    cases.missing += planned.missing;
    display.expect(experiment.id, planned);
  }

  FolderLaboratory laboratory(options, command.threads, journal, display.observer());
  Page page;
  page.remaining = static_cast<int>(all.size());
  std::string failed;
  for (const Experiment& experiment : all) {
    display.beginExperiment(experiment.id);
    page.sections.push_back(sectionOf(experiment, laboratory, failed));
    --page.remaining;
    page.facts = factsOf(options, build, laboratory.execution().threads(), cases);
    write(page, options.folder);
  }
  display.clear();
  if (!failed.empty())
    throw std::runtime_error(failed + "; the others are in '" + options.folder + "'");
  if (!command.quiet)
    std::printf("wrote %s\n", (fs::path(options.folder) / "index.html").c_str());
}

} // namespace mrf_apps

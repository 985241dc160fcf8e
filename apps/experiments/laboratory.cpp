// SPDX-License-Identifier: BSD-3-Clause
#include "laboratory.h"

#include "support/output_files.h"

#include <pcl/surface/mrf/exceptions.h>

#include <exception>
#include <filesystem>
#include <utility>

namespace mrf_apps {

using nlohmann::json;

namespace {

std::string pathIn(const std::string& folder, const std::string& file)
{
  return (std::filesystem::path(folder) / file).string();
}

class PlanningLaboratory : public Laboratory {
public:
  PlanningLaboratory(const ExperimentOptions& options, const Journal& journal) : options_(options), journal_(journal) {}

  const ExperimentOptions& options() const override { return options_; }
  pcl::mrf::Execution& execution() override { return execution_; }

  json measure(const std::string& key, const std::function<json()>&) override
  {
    if (const json* known = journal_.find(key)) {
      ++result.known;
      return *known;
    }
    ++result.missing;
    return {{"failed", "not measured"}};
  }

  void draw(const std::string&, const PictureOptions&, const std::function<SurfaceMesh()>&) override {}

  Plan result;

private:
  ExperimentOptions options_;
  const Journal& journal_;
  pcl::mrf::Execution execution_{1};
};

} // namespace

FolderLaboratory::FolderLaboratory(const ExperimentOptions& options, int threads, Journal& journal,
                                   CaseObserver observer)
    : options_(options), execution_(threads), journal_(journal), observer_(std::move(observer))
{}

json FolderLaboratory::measure(const std::string& key, const std::function<json()>& compute)
{
  if (const json* known = journal_.find(key)) {
    observer_.done(key, false);
    return *known;
  }
  observer_.begun(key);
  json result;
  try {
    result = compute();
  } catch (const pcl::mrf::Cancelled&) {
    throw;
  } catch (const pcl::mrf::Error& error) {
    result = {{"failed", error.message()}};
  }
  // What a later run reads: numbers that are not finite become null.
  result = json::parse(result.dump(-1, ' ', false, json::error_handler_t::replace));
  journal_.add(key, result);
  observer_.done(key, true);
  return result;
}

void FolderLaboratory::draw(const std::string& file, const PictureOptions& options,
                            const std::function<SurfaceMesh()>& mesh)
{
  const std::string path = pathIn(options_.folder, file);
  if (!options_.hasPictures || (journal_.isOwnPicture(file) && std::filesystem::exists(path)))
    return;
  observer_.begun(file);
  try {
    OutputFiles output;
    output.add(path);
    const SurfaceMesh drawn = mesh();
    output.write(path, [&](const std::string& temporary) { writePicture(drawn, options, temporary); });
    output.publish();
  } catch (const pcl::mrf::Cancelled&) {
    throw;
  } catch (const pcl::mrf::Error&) {
    // The case has no surface, which its measurement tells; one of an earlier run must not stand for it.
    std::filesystem::remove(path);
    return;
  }
  journal_.addPicture(file);
}

Plan plan(const Experiment& experiment, const ExperimentOptions& options, const Journal& journal)
{
  PlanningLaboratory laboratory(options, journal);
  try {
    experiment.run(laboratory);
  } catch (const std::exception&) {
    // The run itself tells what is wrong.
  }
  return laboratory.result;
}

} // namespace mrf_apps

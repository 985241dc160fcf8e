// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The laboratory that keeps its results in a folder, and the one that only counts what there is to do.
#pragma once

#include "experiment.h"
#include "journal.h"

#include <functional>
#include <string>

namespace mrf_apps {

/// Called before a case is measured or drawn, and once it is done.
struct CaseObserver {
  std::function<void(const std::string& key)> begun;
  std::function<void(const std::string& key, bool isNew)> done;
};

class FolderLaboratory : public Laboratory {
public:
  /// \param options `folder` exists
  FolderLaboratory(const ExperimentOptions& options, int threads, Journal& journal, CaseObserver observer);

  const ExperimentOptions& options() const override { return options_; }
  pcl::mrf::Execution& execution() override { return execution_; }
  nlohmann::json measure(const std::string& key, const std::function<nlohmann::json()>& compute) override;
  void draw(const std::string& file, const PictureOptions& options, const std::function<SurfaceMesh()>& mesh) override;

private:
  ExperimentOptions options_;
  pcl::mrf::Execution execution_;
  Journal& journal_;
  CaseObserver observer_;
};

/// What an experiment would measure and what of it is known, without measuring: cases that are not known are reported
/// to it as failed.
struct Plan {
  int known = 0, missing = 0;
};
Plan plan(const Experiment& experiment, const ExperimentOptions& options, const Journal& journal);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "case_display.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace mrf_apps {

CaseDisplay::CaseDisplay(bool isQuiet)
    : isQuiet_(isQuiet), isTerminal_(isatty(STDERR_FILENO) != 0), start_(std::chrono::steady_clock::now())
{}

void CaseDisplay::expect(const std::string& experiment, const Plan& plan)
{
  plans_[experiment] = plan;
  expected_ += plan.known + plan.missing;
  missing_ += plan.missing;
}

void CaseDisplay::beginExperiment(const std::string& id)
{
  const auto former = plans_.find(experiment_);
  if (former != plans_.end())
    finished_ += former->second.known + former->second.missing;
  experiment_ = id;
  done_ = 0;
  if (!isQuiet_ && !isTerminal_) {
    const Plan& plan = plans_[id];
    std::printf("%s: %d cases, %d of them to be measured\n", id.c_str(), plan.known + plan.missing, plan.missing);
    std::fflush(stdout);
  }
}

CaseObserver CaseDisplay::observer()
{
  return {[this](const std::string& key) { begin(key); }, [this](const std::string&, bool isNew) { end(isNew); }};
}

void CaseDisplay::begin(const std::string& key)
{
  if (isQuiet_)
    return;
  const Plan& plan = plans_[experiment_];
  // A plan is made before the cases are known that depend on others' results.
  const int ofExperiment = std::max(plan.known + plan.missing, done_ + 1);
  const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (!isTerminal_) {
    std::printf("%7.1f s   %s (%d of %d)\n", elapsed, key.c_str(), std::min(done_ + 1, ofExperiment), ofExperiment);
    std::fflush(stdout);
    return;
  }
  std::string left;
  if (measured_ >= 5 && missing_ > measured_) {
    const double seconds = elapsed / measured_ * (missing_ - measured_);
    left = ", about " + std::to_string(static_cast<int>(std::ceil(seconds / 60))) + " min left";
  }
  constexpr int width = 30;
  const double share = static_cast<double>(finished_ + done_) / std::max(expected_, finished_ + ofExperiment);
  const auto filled = static_cast<std::size_t>(std::lround(width * std::min(share, 1.)));
  std::fprintf(stderr, "\r\033[K[%s%s] %s (%d of %d%s)", std::string(filled, '#').c_str(),
               std::string(width - filled, ' ').c_str(), key.c_str(), std::min(done_ + 1, ofExperiment), ofExperiment,
               left.c_str());
  std::fflush(stderr);
  isDrawn_ = true;
}

void CaseDisplay::end(bool isNew)
{
  ++done_;
  measured_ += isNew ? 1 : 0;
}

void CaseDisplay::clear()
{
  if (isDrawn_)
    std::fputs("\r\033[K", stderr);
  isDrawn_ = false;
}

} // namespace mrf_apps

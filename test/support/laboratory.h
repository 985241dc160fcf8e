// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief A laboratory for tests of the sections that experiments make of their results.
#pragma once

#include <experiments/experiment.h>

#include <gtest/gtest.h>

#include <functional>
#include <set>
#include <string>

namespace mrf_test {

/// Gives the result that a function makes up for each key, and measures nothing.
class MadeUp : public mrf_apps::Laboratory {
public:
  explicit MadeUp(std::function<nlohmann::json(const std::string& key)> result) : result_(std::move(result))
  {
    settings.quick = true;
    settings.hasPictures = false;
  }

  const mrf_apps::ExperimentOptions& options() const override { return settings; }
  pcl::mrf::Execution& execution() override { return execution_; }
  nlohmann::json measure(const std::string& key, const std::function<nlohmann::json()>&) override
  {
    EXPECT_TRUE(keys.insert(key).second) << key << " is measured twice";
    return result_(key);
  }
  void draw(const std::string&, const mrf_apps::PictureOptions&, const std::function<mrf_apps::SurfaceMesh()>&) override
  {}

  std::set<std::string> keys;
  mrf_apps::ExperimentOptions settings;

private:
  std::function<nlohmann::json(const std::string&)> result_;
  pcl::mrf::Execution execution_;
};

/// Measures one case, and makes up the others.
class MeasuresOne : public MadeUp {
public:
  /// \param key empty: the first one that is asked for
  MeasuresOne(std::string key, std::function<nlohmann::json(const std::string& key)> others)
      : MadeUp(std::move(others)), key_(std::move(key))
  {}

  nlohmann::json measure(const std::string& key, const std::function<nlohmann::json()>& compute) override
  {
    const bool isIt = key_.empty() ? keys.empty() : key == key_;
    const nlohmann::json known = MadeUp::measure(key, compute);
    if (!isIt)
      return known;
    // As the journal keeps it: numbers that are not finite become null.
    measured = nlohmann::json::parse(compute().dump());
    return measured;
  }

  nlohmann::json measured; ///< null before

private:
  std::string key_;
};

} // namespace mrf_test

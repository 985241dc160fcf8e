// SPDX-License-Identifier: BSD-3-Clause
/// Runs a command-line tool as a user does, in a folder of its own.
#pragma once

#include "clouds.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace tool {

struct Outcome {
  int status = -1; ///< exit status; 128 + the signal if one ended it
  std::string out, err;
};

/// Runs any program and waits for it. \param folder its working directory
/// \param withDisplay false: without DISPLAY in its environment
Outcome runProgram(const std::vector<std::string>& command, const std::filesystem::path& folder,
                   bool withDisplay = true);

/// True if a program of this name is in PATH.
bool hasProgram(const std::string& name);

std::string readText(const std::filesystem::path& path);
void writeText(const std::filesystem::path& path, const std::string& text);

using clouds::spherePoints;

/// Rows "x y z nx ny nz" of points of the unit sphere about the center.
std::string sphereRows(int count, double top = 2, const Eigen::Vector3d& center = Eigen::Vector3d::Zero());

std::vector<std::string> linesOf(const std::string& text);

/// The long names of the options that a help lists.
std::set<std::string> optionsListed(const std::string& help);

/// Both lists as one.
std::vector<std::string> with(std::vector<std::string> words, const std::vector<std::string>& more);

/// A test of a program, in an empty folder that is removed after the test.
class Test : public testing::Test {
protected:
  /// \param program path; empty: pcl_mrf_reconstruction
  explicit Test(const std::string& program = {});
  ~Test() override;

  /// Runs the program in the folder.
  Outcome run(const std::vector<std::string>& arguments) const;

  /// The same; throws, which ends the test, unless the program succeeds.
  Outcome succeed(const std::vector<std::string>& arguments) const;

  /// The same; expects nothing on standard error. \return the parsed --report
  nlohmann::json reportOf(const std::vector<std::string>& arguments) const;

  /// Expects a failure with `words` in its one line of message, and an unchanged folder.
  void expectFailure(const std::vector<std::string>& arguments, int status, const std::string& words) const;

  /// Reads a JSON file of the folder; expects that it is valid.
  nlohmann::json parsed(const std::string& name) const;

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  void write(const std::string& name, const std::string& text) const { writeText(path(name), text); }

  /// Names in the folder, or in one of its own, hidden ones included, sorted.
  std::vector<std::string> files(const std::string& subfolder = {}) const;

private:
  std::filesystem::path program_, folder_;
};

} // namespace tool

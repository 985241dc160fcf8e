// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Options of a tool that set members of pcl::mrf::Options, on top of a preset.
#pragma once

#include "support/tool_options.h"

#include <pcl/surface/mrf/option_table.h>

#include <functional>
#include <string>
#include <vector>

namespace mrf_apps {

/// Registers declared options, collects what the user set, and applies it to a preset.
class OptionParser : public ToolOptions {
public:
  using ToolOptions::ToolOptions;
  using Options = pcl::mrf::Options;

  /// \param name of an option in the library's table
  CLI::Option* declared(const std::string& name);

  /// A switch of the library's table that is off by default, as a flag that switches it on.
  CLI::Option* declaredFlag(const std::string& name);

  /// Has the options changed by what the user set.
  void change(const std::function<void(Options&)>& change) { changes_.push_back(change); }

  /// Applies what the user set, in the order of the help.
  void apply(Options& options) const
  {
    for (const auto& change : changes_)
      change(options);
  }

private:
  std::string set(const pcl::mrf::OptionDeclaration& option, const std::string& text);

  std::vector<std::function<void(Options&)>> changes_;
};

} // namespace mrf_apps

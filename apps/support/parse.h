/// \file
/// \brief The ends of a command line: help, version, and errors of usage. For tools that use CLI11.
#pragma once

#include "errors.h"

#include <CLI/CLI.hpp>

#include <string>

namespace mrf_apps {

/// Parses. \param version answer to --version, without the end of line
/// \return the text that --help or --version asks for; empty: the command is to be run
/// \throw UsageError
inline std::string parse(CLI::App& app, int argc, const char* const* argv, const std::string& version)
{
  app.set_version_flag("--version", version)->group(app.get_help_ptr()->get_group());
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    return app.help();
  } catch (const CLI::CallForVersion&) {
    return version + "\n";
  } catch (const CLI::ParseError& error) {
    throw UsageError(error.what());
  }
  return {};
}

} // namespace mrf_apps

/// \file
/// \brief The ends of a command line: help, version, and errors of usage. For tools that use CLI11.
#pragma once

#include "errors.h"

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace mrf_apps {

/// \param arguments that belong to no option, in their order
inline std::string unexpected(const std::vector<std::string>& arguments)
{
  for (const std::string& argument : arguments)
    if (argument.size() > 1 && argument[0] == '-')
      return "'" + argument + "' is not an option";
  return "'" + arguments.front() + "' is one argument too many";
}

/// \param message of CLI11 about an option with too many or too few values; its name comes first
inline std::string misplaced(const CLI::App& app, const std::string& message)
{
  const std::string name = message.substr(0, message.find(':'));
  const CLI::Option* option = app.get_option_no_throw(name);
  if (option == nullptr)
    return message;
  return name + (option->count() > 1 ? " is given more than once" : " needs a value");
}

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
  } catch (const CLI::ExtrasError&) {
    throw UsageError(unexpected(app.remaining()));
  } catch (const CLI::ArgumentMismatch& error) {
    throw UsageError(misplaced(app, error.what()));
  } catch (const CLI::ParseError& error) {
    throw UsageError(error.what());
  }
  return {};
}

} // namespace mrf_apps

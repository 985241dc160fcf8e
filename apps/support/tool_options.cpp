// SPDX-License-Identifier: BSD-3-Clause
#include "tool_options.h"

#include "errors.h"
#include "sensors.h"

#include <algorithm>
#include <cmath>

namespace mrf_apps {
namespace {

/// The minimum number of letters to insert, drop, change, or swap with the next that turns one word into the other.
std::size_t editDistance(const std::string& a, const std::string& b)
{
  // Row i holds the distances of the first i letters of a from the beginnings of b.
  std::vector<std::vector<std::size_t>> distance(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      std::size_t& best = distance[i][j];
      best = i + j;
      if (i > 0 && j > 0)
        best = std::min(
            {distance[i - 1][j] + 1, distance[i][j - 1] + 1, distance[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        best = std::min(best, distance[i - 2][j - 2] + 1);
    }
  return distance[a.size()][b.size()];
}

/// The end of a message: "; did you mean NEAREST?" if a candidate begins with the word, or is at most one edit per
/// three letters away; else empty.
std::string didYouMean(const std::string& word, const std::vector<std::string>& candidates)
{
  constexpr std::size_t longestWord = 100; // nobody mistypes a longer one, and the time grows with its square
  const auto letters = word.size() - static_cast<std::size_t>(std::count(word.begin(), word.end(), '-'));
  std::string best;
  std::size_t min = letters == 0 || word.size() > longestWord ? 0 : letters / 3 + 1;
  for (const std::string& candidate : candidates) {
    const bool isBeginning = letters > 1 && candidate.compare(0, word.size(), word) == 0;
    const std::size_t edits = min == 0 ? 0 : isBeginning ? 0 : editDistance(word, candidate);
    if (edits < min) {
      min = edits;
      best = candidate;
    }
  }
  return best.empty() ? "" : "; did you mean " + best + "?";
}

std::string longName(const std::string& name)
{
  return name.substr(name.rfind(',') + 1);
}

/// \param message of CLI11 about an option with too many or too few values; its name comes first
std::string misplaced(const CLI::App& app, const std::string& message)
{
  const std::string name = message.substr(0, message.find(':'));
  const CLI::Option* option = app.get_option_no_throw(name);
  if (option == nullptr)
    return message;
  return name + (option->count() > 1 ? " is given more than once" : " needs a value");
}

} // namespace

ToolOptions::ToolOptions(const std::string& tool, const std::string& version, const std::string& summary)
    : app_(summary, tool)
{
  texts.tool = tool;
  texts.version = version;
  texts.summary = summary;
  app_.set_help_flag();
  // Registered first, so that --help works whatever else is wrong; listed last.
  information("-h,--help", "print a short help", [this] { return shortHelp(texts); });
  information("--help-all", "print this help", [this] { return fullHelp(texts); });
  information("--version", "print the version", [this] { return texts.tool + " " + texts.version + "\n"; });
  information("--manual", "print a manual page for man", [this] { return manualPage(texts); });
  information("--bash-completion", "print a script that completes these options in bash",
              [this] { return bashCompletion(texts); });
  last_ = std::move(texts.options);
  texts.options.clear();
}

void ToolOptions::information(const std::string& name, const std::string& help,
                              const std::function<std::string()>& text)
{
  group_ = "Information";
  flag(name, help, [text] { throw Information{text()}; });
  group_ = "Options";
}

OptionText& ToolOptions::describe(const std::string& name, const std::string& help)
{
  const std::size_t comma = name.find(',');
  texts.options.push_back(
      {longName(name), comma == std::string::npos ? "" : name.substr(0, comma), "", help, group_, {}});
  return texts.options.back();
}

void ToolOptions::operands(std::vector<std::string>& target, std::size_t max)
{
  app_.add_option_function<std::vector<std::string>>("OPERANDS", [&target, max](const std::vector<std::string>& all) {
    if (all.size() > max)
      throw UsageError("'" + all[max] + "' is one argument too many");
    if (isOneOf("", all))
      throw UsageError("'' is not the name of a file");
    target = all;
  });
}

CLI::Option* ToolOptions::add(const std::string& name, const std::string& unit, const std::string& help,
                              const std::function<std::string(const std::string&)>& set)
{
  describe(name, help).value = unit;
  const auto use = [set, told = longName(name)](const std::string& text) {
    const std::string wrong = set(text);
    if (!wrong.empty())
      throw UsageError(told + ": '" + text + "' " + wrong);
  };
  return app_.add_option_function<std::string>(name, use, help);
}

CLI::Option* ToolOptions::words(const std::string& name, const std::vector<std::string>& words, const std::string& help,
                                const std::function<void(const std::string&)>& set)
{
  const auto use = [words, set](const std::string& text) -> std::string {
    if (!isOneOf(text, words))
      return "is none of " + joined(words) + didYouMean(text, words);
    set(text);
    return {};
  };
  CLI::Option* option = add(name, joined(words, "|"), help, use);
  texts.options.back().words = words;
  return option;
}

CLI::Option* ToolOptions::flag(const std::string& name, const std::string& help, const std::function<void()>& set)
{
  describe(name, help);
  return app_.add_flag_callback(name, set, help);
}

CLI::Option* ToolOptions::flag(const std::string& name, bool& target, const std::string& help)
{
  return flag(name, help, [&target] { target = true; });
}

void ToolOptions::number(const std::string& name, const std::string& unit, double& target, const std::string& help,
                         double above)
{
  add(name, unit, help, [&target, above](const std::string& text) {
    const bool isNumber = toNumber(text, target) && std::isfinite(target);
    return !isNumber ? "is not a number" : target > above ? "" : "is outside its range > 0";
  });
}

std::string ToolOptions::checkWhole(const std::string& text, double lower, double upper, double& value)
{
  if (!toNumber(text, value) || !std::isfinite(value) || value != std::floor(value))
    return "is not a whole number";
  if (value >= lower && value <= upper)
    return {};
  const auto digits = [](double number) { return std::to_string(static_cast<std::int64_t>(number)); };
  return "is outside its range [" + digits(lower) + ", " + digits(upper) + "]";
}

void ToolOptions::vector(const std::string& name, Eigen::Vector3d& target, const std::string& help)
{
  add(name, "X,Y,Z", help,
      [&target](const std::string& text) { return parseSensor(text, target) ? "" : "is not three numbers X,Y,Z"; });
}

CLI::Option* ToolOptions::vectors(const std::string& name, std::vector<Eigen::Vector3d>& targets,
                                  const std::string& help)
{
  return add(name, "X,Y,Z", help,
             [&targets](const std::string& text) {
               targets.emplace_back();
               return parseSensor(text, targets.back()) ? "" : "is not three numbers X,Y,Z";
             })
      ->trigger_on_parse()
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
}

CLI::Option* ToolOptions::file(const std::string& name, const std::string& unit, std::string& target,
                               const std::string& help)
{
  return add(name, unit, help, [&target, wanted = extension(unit)](const std::string& text) -> std::string {
    target = text;
    if (text.empty())
      return "is not the name of a file";
    return wanted.empty() || extension(text) == wanted ? "" : "does not end in ." + wanted;
  });
}

/// \param typed all words of the command line: the parser splits "-voxel" into -v and "-oxel"
void ToolOptions::refuseUnknown(const std::vector<std::string>& typed) const
{
  const std::vector<std::string> words = app_.remaining();
  std::vector<std::string> names;
  for (const OptionText& option : texts.options)
    names.push_back(option.name);
  for (const std::string& word : words)
    if (word.size() > 1 && word[0] == '-') {
      const auto isWhole = [&word, tail = word.substr(1)](const std::string& other) {
        return other == word || (other.size() > word.size() && other[0] == '-' && other[1] != '-' &&
                                 other.substr(other.size() - tail.size()) == tail);
      };
      const auto found = std::find_if(typed.begin(), typed.end(), isWhole);
      const std::string whole = found == typed.end() ? word : *found, name = whole.substr(0, whole.find('='));
      const auto hint = texts.hints.find(name);
      throw UsageError("'" + whole + "' is not an option" +
                       (hint == texts.hints.end() ? didYouMean(name, names) : "; " + hint->second));
    }
  throw UsageError("'" + words.front() + "' is one argument too many");
}

void ToolOptions::parse(int argc, const char* const* argv)
{
  texts.options.insert(texts.options.end(), last_.begin(), last_.end());
  last_.clear();
  try {
    app_.parse(argc, argv);
  } catch (const CLI::ExtrasError&) {
    refuseUnknown({argv + 1, argv + argc});
  } catch (const CLI::ArgumentMismatch& error) {
    throw UsageError(misplaced(app_, error.what()));
  } catch (const CLI::ParseError& error) {
    throw UsageError(error.what());
  }
}

} // namespace mrf_apps

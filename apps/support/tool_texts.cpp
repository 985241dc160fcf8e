// SPDX-License-Identifier: BSD-3-Clause
#include "tool_options.h"

#include <algorithm>
#include <cctype>
#include <sstream>

namespace mrf_apps {
namespace {

constexpr std::size_t screenWidth = 80;

/// Appends words in lines that fit the screen. \param indent of all lines \param column where the first one continues
void addWrapped(const std::string& words, std::size_t indent, std::size_t column, std::string& text)
{
  std::istringstream stream(words);
  bool isFirst = true;
  for (std::string word; stream >> word;) {
    if (column + (isFirst ? 0 : 1) + word.size() > screenWidth && column > indent) {
      text += "\n" + std::string(indent, ' ');
      column = indent;
      isFirst = true;
    }
    text += (isFirst ? "" : " ") + word;
    column += (isFirst ? 0 : 1) + word.size();
    isFirst = false;
  }
  text += "\n";
}

/// A term and its explanation beside it, or below it if the term is long.
void addEntry(const std::string& term, const std::string& explanation, std::size_t column, std::string& text)
{
  text += "  " + term;
  if (2 + term.size() + 2 > column)
    text += "\n" + std::string(column, ' ');
  else
    text += std::string(column - 2 - term.size(), ' ');
  addWrapped(explanation, column, column, text);
}

void addNote(const std::string& note, std::string& text)
{
  std::istringstream lines(note);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t indent = std::min(line.find_first_not_of(' '), line.size());
    text.append(indent, ' ');
    addWrapped(line, indent, indent, text);
  }
}

std::string termOf(const OptionText& option)
{
  return (option.shortName.empty() ? "" : option.shortName + ", ") + option.name +
         (option.value.empty() ? "" : " " + option.value);
}

/// The same for the short help, which has no room for many words.
std::string shortTermOf(OptionText option)
{
  constexpr std::size_t longest = 22;
  if (!option.words.empty() && termOf(option).size() > longest)
    option.value = "WORD";
  return termOf(option);
}

using Entries = std::vector<std::pair<std::string, std::string>>;

/// Usage, summary, and terms with their explanations.
std::string beginningOf(const ToolTexts& texts, const Entries& entries, std::size_t column)
{
  std::string text;
  for (const std::string& line : texts.usage)
    text += (&line == &texts.usage.front() ? "Usage: " : "       ") + texts.tool + " " + line + "\n";
  text += "\n";
  addWrapped(texts.summary, 0, 0, text);
  text += "\n";
  for (const auto& [term, explanation] : entries)
    addEntry(term, explanation, column, text);
  return text;
}

/// The groups in the order of their first options.
std::vector<std::string> groupsOf(const ToolTexts& texts)
{
  std::vector<std::string> groups;
  for (const OptionText& option : texts.options)
    if (!isOneOf(option.group, groups))
      groups.push_back(option.group);
  return groups;
}

/// Plain text for troff: dashes stay dashes, backslashes are none of its commands, and no line begins one.
std::string troff(const std::string& text)
{
  std::string result;
  for (const char c : text)
    if (c == '-')
      result += "\\-";
    else if (c == '\\')
      result += "\\e";
    else
      result += c;
  if (!result.empty() && (result[0] == '.' || result[0] == '\''))
    result.insert(0, "\\&");
  return result;
}

} // namespace

std::string shortHelp(const ToolTexts& texts)
{
  Entries entries = texts.operands;
  for (const auto& [name, help] : texts.everyday)
    for (const OptionText& option : texts.options)
      if (option.name == name)
        entries.emplace_back(shortTermOf(option), help);
  std::size_t longest = 0;
  for (const auto& entry : entries)
    longest = std::max(longest, entry.first.size());
  return beginningOf(texts, entries, longest + 4) + "Example: " + texts.tool + " " + texts.examples.front() + "\n";
}

std::string fullHelp(const ToolTexts& texts)
{
  constexpr std::size_t column = 28;
  std::string text = beginningOf(texts, texts.operands, column);
  for (const std::string& group : groupsOf(texts)) {
    text += "\n" + group + ":\n";
    for (const OptionText& option : texts.options)
      if (option.group == group)
        addEntry(termOf(option), option.help, column, text);
  }
  for (const std::string& note : texts.notes) {
    text += "\n";
    addNote(note, text);
  }
  text += "\nExamples:\n";
  for (const std::string& example : texts.examples)
    text += "  " + texts.tool + " " + example + "\n";
  return text;
}

std::string manualPage(const ToolTexts& texts)
{
  std::string summary = texts.summary.substr(0, texts.summary.find_last_not_of('.') + 1);
  summary[0] = static_cast<char>(std::tolower(summary[0]));
  std::string page = ".TH " + upperCase(texts.tool) + " 1 \"\" \"" + texts.version + "\" \"User Commands\"\n";
  page += ".SH NAME\n" + troff(texts.tool) + " \\- " + troff(summary) + "\n.SH SYNOPSIS\n.nf\n";
  for (const std::string& line : texts.usage)
    page += "\\fB" + troff(texts.tool) + "\\fR " + troff(line) + "\n";
  page += ".fi\n.SH DESCRIPTION\n";
  for (const auto& [operand, help] : texts.operands)
    page += ".TP\n.I " + troff(operand) + "\n" + troff(help) + "\n";
  page += ".SH OPTIONS\n";
  for (const std::string& group : groupsOf(texts)) {
    page += ".SS " + troff(group) + "\n";
    for (const OptionText& option : texts.options)
      if (option.group == group)
        page += ".TP\n\\fB" + (option.shortName.empty() ? "" : troff(option.shortName) + "\\fR, \\fB") +
                troff(option.name) + "\\fR \\fI" + troff(option.value) + "\\fR\n" + troff(option.help) + "\n";
  }
  page += ".SH NOTES\n";
  for (const std::string& note : texts.notes) {
    page += ".PP\n";
    std::istringstream lines(note);
    for (std::string line; std::getline(lines, line);)
      page += (line.compare(0, 1, " ") == 0 ? ".br\n\\&" : "") + troff(line) + "\n";
  }
  page += ".SH EXAMPLES\n.nf\n";
  for (const std::string& example : texts.examples)
    page += troff(texts.tool + " " + example) + "\n";
  return page + ".fi\n";
}

std::string bashCompletion(const ToolTexts& texts)
{
  std::string names, words;
  for (const OptionText& option : texts.options) {
    names += " " + option.name + (option.shortName.empty() ? "" : " " + option.shortName);
    if (option.words.empty())
      continue;
    words += "    " + option.name + ") choices=' " + joined(option.words, " ") + "' ;;\n";
  }
  const std::string function = "_" + texts.tool;
  return "# bash completion for " + texts.tool + "\n" + function +
         "()\n{\n"
         "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]} choices=\n"
         "  # --option=value comes as three words.\n"
         "  if [[ $current == = ]]; then\n    current=\n"
         "  elif [[ $previous == = ]]; then\n    previous=${COMP_WORDS[COMP_CWORD-2]}\n  fi\n"
         "  case $previous in\n" +
         words +
         "  esac\n"
         "  [[ -n $choices || $current != -* ]] || choices='" +
         names +
         " '\n  # Where nothing is chosen, bash completes files.\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$choices\" -- \"$current\")\n}\ncomplete -o default -F " +
         function + " " + texts.tool + "\n";
}

} // namespace mrf_apps

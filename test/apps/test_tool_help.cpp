// SPDX-License-Identifier: BSD-3-Clause
// The texts of the tools: a help that fits on a screen, a full help, a manual page, a completion.
#include "support/tool.h"

#include <algorithm>
#include <regex>
#include <set>

namespace {

using tool::linesOf;
using tool::optionsListed;

/// Each of the tools.
class ToolHelp : public tool::Test, public testing::WithParamInterface<const char*> {
protected:
  ToolHelp() : Test(GetParam()) {}

  std::string name() const { return std::filesystem::path(GetParam()).filename().string(); }

  std::string textOf(const std::string& option) const
  {
    const tool::Outcome outcome = succeed({option});
    EXPECT_EQ(outcome.err, "");
    return outcome.out;
  }
};

TEST_P(ToolHelp, FitsAScreen)
{
  const std::string help = textOf("--help");
  const std::vector<std::string> lines = linesOf(help);
  EXPECT_LE(lines.size(), 24u) << help;
  for (const std::string& line : lines)
    EXPECT_LE(line.size(), 80u) << line;
  EXPECT_NE(help.find("--help-all"), std::string::npos);
  EXPECT_GE(optionsListed(help).size(), 8u);
  EXPECT_EQ(lines.back().rfind("Example: " + name() + " ", 0), 0u) << lines.back();
  EXPECT_EQ(help, textOf("-h"));
}

TEST_P(ToolHelp, TheWholeHelpHasMore)
{
  const std::string all = textOf("--help-all");
  for (const std::string& line : linesOf(all))
    EXPECT_LE(line.size(), 80u) << line;
  const std::set<std::string> listed = optionsListed(all), everyday = optionsListed(textOf("--help"));
  EXPECT_TRUE(std::includes(listed.begin(), listed.end(), everyday.begin(), everyday.end()));
  EXPECT_GT(listed.size(), everyday.size());
  EXPECT_FALSE(std::regex_search(all, std::regex("olour|eighbour|entre|torise|grey"))) << "American spelling";
}

TEST_P(ToolHelp, IsGivenWhateverElseIsWrong)
{
  const tool::Outcome outcome = succeed({"--threads", "many", "--help"});
  EXPECT_EQ(outcome.out, textOf("--help"));
}

TEST_P(ToolHelp, VersionIsPrinted)
{
  const std::string version = textOf("--version");
  EXPECT_TRUE(std::regex_match(version, std::regex(name() + " \\d+\\.\\d+\\.\\d+\n"))) << version;
}

TEST_P(ToolHelp, ManualAndCompletionHaveEveryOption)
{
  const std::string manual = textOf("--manual"), completion = textOf("--bash-completion");
  for (const std::string& option : optionsListed(textOf("--help-all"))) {
    EXPECT_NE(manual.find("\\fB" + std::regex_replace(option, std::regex("-"), "\\-") + "\\fR"), std::string::npos)
        << option;
    const std::regex word("[ ']" + option + "[ ']");
    EXPECT_TRUE(std::regex_search(completion, word)) << option;
  }
}

TEST_P(ToolHelp, WhatIsInstalledIsWhatTheToolSays)
{
  const std::filesystem::path pages = MRF_TOOL_PAGES;
  EXPECT_EQ(tool::readText(pages / (name() + ".1")), textOf("--manual"));
  EXPECT_EQ(tool::readText(pages / name()), textOf("--bash-completion"));
}

TEST_P(ToolHelp, TheManualIsGoodTroff)
{
  ASSERT_TRUE(tool::hasProgram("groff")) << "it is in the list of packages";
  write("page.1", textOf("--manual"));
  const tool::Outcome outcome = tool::runProgram({"groff", "-man", "-Tascii", "-ww", "-P-cbou", "page.1"}, path(""));
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.err, "");
  for (const char* heading : {"NAME", "SYNOPSIS", "OPTIONS", "EXAMPLES", "--help-all"})
    EXPECT_NE(outcome.out.find(heading), std::string::npos) << heading;
}

TEST_P(ToolHelp, OptionsNearAMistypedOneAreNamed)
{
  expectFailure({"--hepl"}, 2, "'--hepl' is not an option; did you mean --help?");
  expectFailure({"--thread=3"}, 2, "did you mean --threads?");
  const tool::Outcome outcome = run({"--xyzzyx"});
  EXPECT_EQ(outcome.err, name() + ": '--xyzzyx' is not an option (see --help)\n");
}

INSTANTIATE_TEST_SUITE_P(Tools, ToolHelp, testing::Values(MRF_TOOL, MRF_EVALUATE_TOOL, MRF_SCAN_TOOL),
                         [](const auto& tool) {
                           const std::string path = tool.param;
                           return path.substr(path.rfind('_') + 1);
                         });

class ReconstructionHelp : public tool::Test {
protected:
  /// What bash offers behind these words.
  std::vector<std::string> completed(const std::vector<std::string>& words) const
  {
    const tool::Outcome script = run({"--bash-completion"});
    write("completion", script.out);
    std::string line = ". ./completion; COMP_WORDS=(pcl_mrf_reconstruction";
    for (const std::string& word : words)
      line += " '" + word + "'";
    line += "); COMP_CWORD=" + std::to_string(words.size()) +
            "; _pcl_mrf_reconstruction; printf '%s\\n' \"${COMPREPLY[@]}\"";
    const tool::Outcome outcome = tool::runProgram({"bash", "-c", line}, path(""));
    EXPECT_EQ(outcome.status, 0);
    EXPECT_EQ(outcome.err, "");
    std::vector<std::string> lines = linesOf(outcome.out);
    std::sort(lines.begin(), lines.end());
    return lines;
  }
};

using Words = std::vector<std::string>;

TEST_F(ReconstructionHelp, BashCompletes)
{
  EXPECT_EQ(completed({"--quali"}), Words{"--quality"});
  EXPECT_EQ(completed({"--quality", ""}), (Words{"draft", "fine", "normal"}));
  EXPECT_EQ(completed({"--quality", "=", "f"}), Words{"fine"});
  write("a scan.ply", "");
  for (const char* before : {"--beta", "--report", "a.ply"})
    EXPECT_EQ(completed({before, "a"}), Words{""}) << "bash completes files where there is no choice";
}

TEST_F(ReconstructionHelp, WhatOthersCallOptionsIsAnswered)
{
  std::filesystem::create_directory(path("scans"));
  expectFailure({"in.ply", "-o", "out.ply"}, 2, "'-o' is not an option; OUTPUT comes behind INPUT");
  expectFailure({"in.ply", "out.ply", "--depth", "9"}, 2, "--voxel-size");
  expectFailure({"scans", "out.ply"}, 2, "INPUT 'scans' is a folder; name its files");
}

TEST_F(ReconstructionHelp, WordsNearAMistypedOneAreNamed)
{
  expectFailure({"--prior", "tri"}, 2, "'tri' is none of membrane, thin-plate, triharmonic; did you mean triharmonic?");
  expectFailure({"--preset", "papre"}, 2, "did you mean paper?");
  expectFailure({"--colour", "none"}, 2, "'--colour' is not an option; did you mean --color?");
  expectFailure({"--neighbours=8"}, 2, "did you mean --neighbors?");
  expectFailure({"--output-dir", "x"}, 2, "did you mean --output-directory?");
  EXPECT_EQ(run({"--quality", "superb"}).err.find("did you mean"), std::string::npos);
}

} // namespace

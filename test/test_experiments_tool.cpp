// pcl_mrf_experiments as its users run it: its files, running again, and whatever goes wrong.
#include "support/tool.h"

#include <algorithm>

namespace {

class ExperimentsTool : public tool::Test {
protected:
  tool::Outcome experiments(std::vector<std::string> arguments) const
  {
    arguments.insert(arguments.begin(), MRF_EXPERIMENTS_TOOL);
    return tool::runProgram(arguments, path(""), false);
  }

  /// Expects a failure that says `words` in one line, and leaves the folder as it was.
  void expectFailure(const std::vector<std::string>& arguments, int status, const std::string& words) const
  {
    std::string trace;
    for (const std::string& argument : arguments)
      trace += argument + " ";
    SCOPED_TRACE(trace);
    const std::vector<std::string> before = files();
    const tool::Outcome outcome = experiments(arguments);
    EXPECT_EQ(outcome.status, status);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(files(), before);
  }
};

} // namespace

TEST_F(ExperimentsTool, ListHelpAndVersion)
{
  const tool::Outcome list = experiments({"--list"});
  ASSERT_EQ(list.status, 0) << list.err;
  for (const char* id : {"fig-2", "fig-3", "fig-4", "fig-5", "fig-9", "sec-3-4", "table-1", "defaults", "guide"})
    EXPECT_NE(("\n" + list.out).find("\n" + std::string(id) + " "), std::string::npos) << id;
  EXPECT_NE(experiments({"--help"}).out.find("--quick"), std::string::npos);
  EXPECT_EQ(experiments({"--version"}).status, 0);
  EXPECT_TRUE(files().empty());
}

TEST_F(ExperimentsTool, WrongInput)
{
  write("file", "x");
  std::filesystem::create_directories(path("taken") / "index.html");
  expectFailure({}, 2, "--output");
  expectFailure({"-o", ""}, 2, "folder");
  expectFailure({"-o", "out", "--only", "fig-2,fig-99"}, 2, "'fig-99'");
  expectFailure({"-o", "out", "--seed", "x"}, 2, "--seed");
  expectFailure({"-o", "out", "--threads", "-1"}, 2, "--threads");
  expectFailure({"-o", "out", "--slow"}, 2, "--slow");
  expectFailure({"-o", "out", "--no-pictures", "--data", "missing"}, 1, "'missing'");
  expectFailure({"-o", "missing/out", "--no-pictures"}, 1, "'missing/out'");
  expectFailure({"-o", "file", "--no-pictures"}, 1, "is not a folder");
  expectFailure({"-o", "taken", "--no-pictures"}, 1, "index.html");
  expectFailure({"-o", "out"}, 1, "--no-pictures");
  EXPECT_FALSE(std::filesystem::exists(path("out")));
}

TEST_F(ExperimentsTool, SameSeedSameTablesAndNothingTwice)
{
  const auto run = [&](const std::string& folder, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"-o", folder, "--quick", "--only", "fig-4", "--no-pictures"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const tool::Outcome outcome = experiments(arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return outcome.out;
  };
  const auto sections = [&](const std::string& folder) {
    return nlohmann::json::parse(tool::readText(path(folder) / "results.json"))["sections"].dump();
  };
  EXPECT_EQ(run("a", {"--threads", "1"}).find(", 0 of them to be measured"), std::string::npos);
  const std::string journal = tool::readText(path("a") / "journal.jsonl");
  run("b", {"--threads", "2"});
  EXPECT_EQ(sections("a"), sections("b"));
  EXPECT_NE(run("a", {}).find(", 0 of them to be measured"), std::string::npos);
  EXPECT_EQ(tool::readText(path("a") / "journal.jsonl"), journal);
  run("b", {"--seed", "2"});
  EXPECT_NE(sections("a"), sections("b"));

  for (const char* file : {"index.html", "results.json", "journal.jsonl"})
    EXPECT_TRUE(std::filesystem::exists(path("a") / file)) << file;
  const nlohmann::json tables = nlohmann::json::parse(sections("a"))[0]["tables"];
  ASSERT_FALSE(tables.empty());
  for (const nlohmann::json& table : tables) {
    const std::string csv = tool::readText(path("a") / (table["name"].get<std::string>() + ".csv"));
    EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')), table["rows"].size() + 1);
  }
  for (const auto& entry : std::filesystem::directory_iterator(path("a")))
    EXPECT_NE(entry.path().filename().string()[0], '.') << "left behind: " << entry.path();
}

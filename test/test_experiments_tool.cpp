// pcl_mrf_experiments as its users run it: its files, running again, and whatever goes wrong.
#include "support/tool.h"

#include <algorithm>

namespace {

class ExperimentsTool : public tool::Test {
protected:
  ExperimentsTool() : Test(MRF_EXPERIMENTS_TOOL) {}
};

} // namespace

TEST_F(ExperimentsTool, ListHelpAndVersion)
{
  const tool::Outcome list = run({"--list"});
  ASSERT_EQ(list.status, 0) << list.err;
  for (const char* id : {"fig-2", "fig-3", "fig-4", "fig-5", "fig-9", "sec-3-4", "table-1", "defaults", "guide"})
    EXPECT_NE(("\n" + list.out).find("\n" + std::string(id) + " "), std::string::npos) << id;
  EXPECT_NE(run({"--help"}).out.find("--quick"), std::string::npos);
  EXPECT_EQ(run({"--version"}).status, 0);
  EXPECT_TRUE(files().empty());
}

TEST_F(ExperimentsTool, WrongInput)
{
  write("file", "x");
  std::filesystem::create_directories(path("taken") / "index.html");
  expectFailure({}, 2, "--output");
  expectFailure({"-o", ""}, 2, "folder");
  expectFailure({"-o", "out", "--only", "fig-2,fig-99"}, 2, "'fig-99'");
  for (const char* seed : {"x", "-1", "1e99"})
    expectFailure({"-o", "out", "--seed", seed}, 2, "--seed");
  expectFailure({"-o", "out", "--threads", "-1"}, 2, "--threads");
  expectFailure({"-o", "out", "--slow"}, 2, "--slow");
  expectFailure({"-o", "out", "--no-pictures", "--data", "missing"}, 1, "'missing'");
  expectFailure({"-o", "out", "--no-pictures", "--data", "taken"}, 1, "reference/igea.ply");
  expectFailure({"-o", "missing/out", "--no-pictures"}, 1, "'missing/out'");
  expectFailure({"-o", "file", "--no-pictures"}, 1, "is not a folder");
  expectFailure({"-o", "taken", "--no-pictures"}, 1, "index.html");
  expectFailure({"-o", "out"}, 1, "--no-pictures");
  EXPECT_FALSE(std::filesystem::exists(path("out")));
}

TEST_F(ExperimentsTool, SameSeedSameTablesAndNothingTwice)
{
  const auto runInto = [&](const std::string& folder, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"-o", folder, "--quick", "--only", "fig-4", "--no-pictures"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const tool::Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    return outcome.out;
  };
  const auto sections = [&](const std::string& folder) {
    return nlohmann::json::parse(tool::readText(path(folder) / "results.json"))["sections"].dump();
  };
  EXPECT_EQ(runInto("a", {"--threads", "1"}).find(", 0 of them to be measured"), std::string::npos);
  const std::string journal = tool::readText(path("a") / "journal.jsonl");
  runInto("b", {"--threads", "2"});
  EXPECT_EQ(sections("a"), sections("b"));
  EXPECT_NE(runInto("a", {}).find(", 0 of them to be measured"), std::string::npos);
  EXPECT_EQ(tool::readText(path("a") / "journal.jsonl"), journal);
  runInto("b", {"--seed", "2"});
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

// SPDX-License-Identifier: BSD-3-Clause
// pcl_mrf_experiments as its users run it: its files, running again, and whatever goes wrong.
#include "support/tool.h"

#include <algorithm>
#include <map>

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
  for (const char* id :
       {"fig-2", "fig-3", "fig-4", "fig-5", "fig-9", "sec-3-4", "table-1", "real", "defaults", "guide"})
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
  expectFailure({"-o", "out", "--sampling", "odd"}, 2, "--sampling");
  expectFailure({"-o", "out", "--no-pictures", "--data", "missing"}, 1, "'missing'");
  expectFailure({"-o", "out", "--no-pictures", "--data", "taken"}, 1, "reference/igea.ply");
  expectFailure({"-o", "missing/out", "--no-pictures"}, 1, "'missing/out'");
  expectFailure({"-o", "file", "--no-pictures"}, 1, "is not a folder");
  expectFailure({"-o", "taken", "--no-pictures"}, 1, "index.html");
  expectFailure({"-o", "out"}, 1, "--no-pictures");
  EXPECT_FALSE(std::filesystem::exists(path("out")));
}

TEST_F(ExperimentsTool, RealCloudsOfAFolder)
{
  // A lattice with a bump and withheld points beside it, as --data has them; and one without withheld points.
  std::string rows, withheld;
  for (int i = 0; i < 40 * 40; ++i) {
    const std::string place = std::to_string(i % 40) + " " + std::to_string(i / 40) + " 0";
    (i % 50 == 25 ? withheld : rows) += place + (i % 50 == 25 ? "\n" : " 0 0 1\n");
  }
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  for (const char* name : {"complete", "plain"}) {
    const std::filesystem::path folder = path("data") / "real" / name;
    std::filesystem::create_directories(folder);
    tool::writeText(folder / "input.ply", tool::asciiPly(rows, true));
  }
  const std::filesystem::path complete = path("data") / "real" / "complete";
  for (const char* name : {"heldout.ply", "heldout_random.ply"})
    tool::writeText(complete / name, tool::asciiPly(withheld, false));
  tool::writeText(complete / "sensors.txt", "20 20 100\n");

  const tool::Outcome outcome = run({"-o", "out", "--quick", "--only", "real", "--no-pictures", "--data", "data"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const nlohmann::json table =
      nlohmann::json::parse(tool::readText(path("out") / "results.json"))["sections"][0]["tables"][0];
  std::map<std::string, int> methods;
  for (const nlohmann::json& row : table["rows"]) {
    const std::string cloud = row[0];
    ++methods[cloud];
    if (cloud == "complete (--data)" && row[1] == "this (default)") {
      // A plane: what is withheld lies in it up to what floats and the solver leave, and all of it is there.
      for (const std::size_t column : {2u, 3u, 4u})
        EXPECT_LT(row[column].get<double>(), .01);
      EXPECT_EQ(row[5], 100);
      EXPECT_EQ(row[7], 0);
      EXPECT_EQ(row[9], lines(rows));
    }
    if (cloud == "plain (--data)") {
      EXPECT_LT(row[9], lines(rows)) << "points are withheld";
    }
  }
  EXPECT_EQ(methods["complete (--data)"], methods["plain (--data)"] + 1) << "normals are estimated for a sensor";
  EXPECT_EQ(methods.count("objects on a table before a wall"), 1u);
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

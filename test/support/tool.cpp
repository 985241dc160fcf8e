// SPDX-License-Identifier: BSD-3-Clause
#include "support/tool.h"

#include <boost/process.hpp>

#include <algorithm>
#include <fstream>
#include <regex>
#include <sstream>

namespace tool {

namespace fs = std::filesystem;
namespace process = boost::process;

std::string readText(const fs::path& path)
{
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void writeText(const fs::path& path, const std::string& text)
{
  std::ofstream file(path, std::ios::binary);
  file << text;
}

Outcome runProgram(const std::vector<std::string>& command, const fs::path& folder, bool withDisplay)
{
  // Beside the folder, so that the folder holds only the program's files.
  const fs::path out = folder.string() + ".out", err = folder.string() + ".err";
  process::environment environment = boost::this_process::environment();
  if (!withDisplay)
    environment.erase("DISPLAY");
  const std::string& name = command.front();
  process::child child(fs::path(name).is_absolute() ? name : process::search_path(name).string(),
                       process::args(std::vector(command.begin() + 1, command.end())), environment,
                       process::start_dir = folder.string(), process::std_out > out.string(),
                       process::std_err > err.string());
  child.wait();
  const int state = child.native_exit_code();
  Outcome outcome;
  outcome.status = WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
  outcome.out = readText(out);
  outcome.err = readText(err);
  fs::remove(out);
  fs::remove(err);
  return outcome;
}

bool hasProgram(const std::string& name)
{
  return !process::search_path(name).empty();
}

std::string sphereRows(int count, double top, const Eigen::Vector3d& center)
{
  std::ostringstream rows;
  rows.precision(center.isZero() ? 6 : 15);
  for (const Eigen::Vector3d& p : spherePoints(count, top))
    rows << (p + center).transpose() << ' ' << p.transpose() << '\n';
  return rows.str();
}

std::vector<std::string> linesOf(const std::string& text)
{
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  return lines;
}

std::set<std::string> optionsListed(const std::string& help)
{
  std::set<std::string> listed;
  const std::regex option("(^|\n)  (-., )?(--[a-z-]+)");
  for (std::sregex_iterator i(help.begin(), help.end(), option), end; i != end; ++i)
    listed.insert((*i)[3]);
  return listed;
}

std::vector<std::string> with(std::vector<std::string> words, const std::vector<std::string>& more)
{
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

Test::Test(const std::string& program) : program_(program.empty() ? MRF_TOOL : program)
{
  std::string pattern = (fs::temp_directory_path() / "mrf_tool_XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr)
    throw std::runtime_error("no temporary folder");
  folder_ = pattern;
}

Test::~Test()
{
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

Outcome Test::run(const std::vector<std::string>& arguments) const
{
  return runProgram(with({program_.string()}, arguments), folder_, false);
}

Outcome Test::succeed(const std::vector<std::string>& arguments) const
{
  Outcome outcome = run(arguments);
  if (outcome.status != 0)
    throw std::runtime_error("status " + std::to_string(outcome.status) + ": " + outcome.err);
  return outcome;
}

nlohmann::json Test::reportOf(const std::vector<std::string>& arguments) const
{
  EXPECT_EQ(succeed(with(arguments, {"--report", "report.json"})).err, "");
  return parsed("report.json");
}

nlohmann::json Test::parsed(const std::string& name) const
{
  nlohmann::json json = nlohmann::json::parse(readText(path(name)), nullptr, false);
  EXPECT_FALSE(json.is_discarded()) << name << " is not JSON";
  return json;
}

void Test::expectFailure(const std::vector<std::string>& arguments, int status, const std::string& words) const
{
  SCOPED_TRACE(testing::PrintToString(arguments));
  const std::vector<std::string> before = files();
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.status, status);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_EQ(outcome.err.rfind(program_.filename().string() + ": ", 0), 0u) << outcome.err;
  EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find("--help") != std::string::npos, status == 2) << outcome.err;
  if (program_ != fs::path(MRF_TOOL)) { // which prints its progress
    EXPECT_EQ(outcome.out, "");
  }
  EXPECT_EQ(files(), before);
}

std::vector<std::string> Test::files(const std::string& subfolder) const
{
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(path(subfolder)))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

} // namespace tool

// SPDX-License-Identifier: BSD-3-Clause
#include "program.h"

#include "support/errors.h"

#include <pcl/surface/mrf/exceptions.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace mrf_apps {
namespace {

using pcl::mrf::InvalidInput;

double secondsOf(int who)
{
  rusage usage{};
  getrusage(who, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double secondsUntilNow()
{
  return secondsOf(RUSAGE_SELF) + secondsOf(RUSAGE_CHILDREN);
}

} // namespace

std::string findProgram(const std::string& name)
{
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path candidate = std::filesystem::path(folder) / name;
    std::error_code error;
    if (std::filesystem::is_regular_file(candidate, error) && access(candidate.c_str(), X_OK) == 0)
      return candidate.string();
  }
  return {};
}

void runProgram(const std::vector<std::string>& command)
{
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& argument : command)
    arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  for (const int descriptor : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, descriptor, "/dev/null", O_WRONLY, 0);
  pid_t process = 0;
  const int failure = posix_spawn(&process, command.front().c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failure != 0)
    throw InvalidInput("'" + command.front() + "' cannot be started: " + std::strerror(failure));

  int status = 0;
  while (waitpid(process, &status, 0) < 0)
    if (errno != EINTR)
      throw InvalidInput("'" + command.front() + "' was lost: " + std::strerror(errno));
  if (WIFSIGNALED(status))
    throw InvalidInput("'" + command.front() + "' was ended by signal " + std::to_string(WTERMSIG(status)));
  if (WEXITSTATUS(status) != 0)
    throw InvalidInput("'" + command.front() + "' ended with status " + std::to_string(WEXITSTATUS(status)));
}

TemporaryFolder::TemporaryFolder()
{
  std::string name = (std::filesystem::temp_directory_path() / "pcl_mrf_XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr)
    throw FileError(name, std::string("cannot be made: ") + std::strerror(errno));
  folder_ = name;
}

TemporaryFolder::~TemporaryFolder()
{
  std::error_code error;
  std::filesystem::remove_all(folder_, error);
}

Stopwatch::Stopwatch() : start_(secondsUntilNow()) {}

double Stopwatch::processorSeconds() const
{
  return secondsUntilNow() - start_;
}

} // namespace mrf_apps

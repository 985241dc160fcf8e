// SPDX-License-Identifier: BSD-3-Clause
#include "output_files.h"

#include "errors.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <unistd.h>

namespace mrf_apps {

namespace fs = std::filesystem;

/// Entries are never freed, so that a signal handler may go through them at any time.
struct TemporaryFile {
  std::string path;
  TemporaryFile* next;
  std::atomic<bool> isThere{true};
};

namespace {

std::atomic<TemporaryFile*> temporaryFiles{nullptr};

void removeFile(TemporaryFile& file)
{
  if (file.isThere.exchange(false))
    unlink(file.path.c_str());
}

[[noreturn]] void fail(const std::string& path)
{
  throw FileError(path == "-" ? "standard output" : path, std::string("cannot be written: ") + std::strerror(errno));
}

/// Creates a temporary file beside the target: .STEM.PROCESS.part.EXTENSION. Those of killed processes are removed.
TemporaryFile* createTemporary(const std::string& path, const fs::path& target)
{
  const std::string before = "." + target.stem().string() + ".", after = ".part" + target.extension().string();
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(target.parent_path(), ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= before.size() + after.size() || name.rfind(before, 0) != 0 ||
        name.compare(name.size() - after.size(), after.size(), after) != 0)
      continue;
    const std::string process = name.substr(before.size(), name.size() - before.size() - after.size());
    if (process.size() < 10 && process.find_first_not_of("0123456789") == std::string::npos &&
        kill(std::stoi(process), 0) != 0 && errno == ESRCH)
      fs::remove(entry, ignored);
  }
  const fs::path whole = target.parent_path() / (before + std::to_string(getpid()) + after);
  // Listed before it is created, so that a signal in between leaves no file behind.
  temporaryFiles = new TemporaryFile{whole.string(), temporaryFiles};
  const int descriptor = open(whole.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (descriptor < 0) {
    temporaryFiles.load()->isThere = false;
    fail(path);
  }
  close(descriptor);
  return temporaryFiles;
}

void copyToStandardOutput(std::FILE* spool)
{
  std::vector<char> block(1 << 16);
  std::rewind(spool);
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), spool))
    if (std::fwrite(block.data(), 1, count, stdout) != count)
      fail("-");
  if (std::ferror(spool) != 0 || std::fflush(stdout) != 0)
    fail("-");
}

} // namespace

OutputFiles::~OutputFiles()
{
  for (const File& file : files_)
    if (file.temporary != nullptr)
      removeFile(*file.temporary);
}

void OutputFiles::add(const std::string& path)
{
  if (path.empty())
    return;
  std::error_code error;
  File file;
  file.path = file.target = path;
  if (path == "-") {
    file.spool.reset(std::tmpfile());
    if (!file.spool)
      fail(path);
  } else {
    const fs::path target = fs::weakly_canonical(fs::absolute(path, error), error);
    if (target.empty()) // such as a link to a pipe
      throw FileError(path, "is no file; standard output is called -");
    if (fs::is_directory(target, error) || !target.has_filename())
      throw FileError(path, "is a directory");
    if (fs::status(target.parent_path(), error).type() == fs::file_type::not_found)
      throw FileError(path, "cannot be written: there is no folder " + target.parent_path().string());
    if (fs::exists(fs::symlink_status(target, error)) && !fs::is_regular_file(target, error))
      throw FileError(path, "is not a regular file; it would be replaced by one");
    if (fs::exists(target, error) && access(target.c_str(), W_OK) != 0)
      fail(path);
    file.target = target.string();
  }
  if (std::any_of(files_.begin(), files_.end(), [&](const File& other) { return other.target == file.target; }))
    throw UsageError("'" + path + "' is asked for twice");
  if (path != "-")
    file.temporary = createTemporary(path, file.target);
  files_.push_back(std::move(file));
}

std::int64_t OutputFiles::write(const std::string& path, const std::function<void(const std::string&)>& writer)
{
  if (path.empty())
    return 0;
  const auto file = std::find_if(files_.begin(), files_.end(), [&](const File& f) { return f.path == path; });
  if (file == files_.end())
    throw std::logic_error(path + " was not declared as an output");
  const std::string written =
      file->spool ? "/proc/self/fd/" + std::to_string(fileno(file->spool.get())) : file->temporary->path;
  try {
    writer(written);
  } catch (const pcl::mrf::FileError& failure) {
    throw FileError(path == "-" ? "standard output" : path, failure.what());
  }
  return static_cast<std::int64_t>(fs::file_size(written));
}

void OutputFiles::publish()
{
  // Standard output first, because its reader may be gone; the other files are known to be writable.
  for (const File& file : files_)
    if (file.spool)
      copyToStandardOutput(file.spool.get());
  for (const File& file : files_)
    if (file.temporary != nullptr) {
      if (std::rename(file.temporary->path.c_str(), file.target.c_str()) != 0)
        fail(file.path);
      file.temporary->isThere = false;
    }
  files_.clear();
}

void makeFolder(const std::string& folder)
{
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder))
    throw FileError(folder, error ? "cannot be made: " + error.message() : "is not a folder");
}

void refuseInputAsOutput(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs)
{
  std::error_code error;
  for (const std::string& input : inputs)
    for (const std::string& output : outputs)
      if (!input.empty() && !output.empty() && output != "-" &&
          (input == output || fs::equivalent(input, output, error)))
        throw UsageError("'" + output + "' is an input and would be overwritten");
}

void endBySignal(int signal)
{
  for (TemporaryFile* file = temporaryFiles; file != nullptr; file = file->next)
    removeFile(*file);
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void removeTemporaryFilesOnSignals()
{
  for (const int signal : {SIGHUP, SIGINT, SIGQUIT, SIGILL, SIGTRAP, SIGABRT, SIGBUS, SIGFPE, SIGUSR1, SIGSEGV, SIGUSR2,
                           SIGALRM, SIGTERM, SIGXCPU, SIGVTALRM, SIGPROF, SIGIO, SIGPWR, SIGSYS}) {
    struct sigaction action = {};
    if (sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_DFL)
      std::signal(signal, endBySignal);
  }
  // Handled rather than ignored, because started programs would inherit that they are ignored.
  for (const int signal : {SIGPIPE, SIGXFSZ})
    std::signal(signal, [](int) {});
}

} // namespace mrf_apps

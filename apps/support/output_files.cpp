#include "output_files.h"

#include "errors.h"
#include "text_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace mrf_apps {

namespace fs = std::filesystem;

bool sameFile(const std::string& a, const std::string& b)
{
  std::error_code error;
  return fs::equivalent(a, b, error);
}

void refuseInputAsOutput(const std::vector<std::string>& inputs, const std::vector<std::string>& outputs)
{
  for (const std::string& input : inputs)
    for (const std::string& output : outputs)
      if (!input.empty() && !output.empty() && (input == output || sameFile(input, output)))
        throw UsageError("'" + output + "' is an input and would be overwritten");
}

OutputFiles::~OutputFiles()
{
  for (const File& file : files_)
    unlink(file.temporary.c_str());
}

void OutputFiles::add(const std::string& path)
{
  std::error_code error;
  // Renaming would replace a symbolic link by the file instead of writing where it leads.
  fs::path target = fs::weakly_canonical(path, error);
  if (error)
    throw FileError(path, error.message());
  if (fs::exists(target, error)) {
    if (fs::is_directory(target, error))
      throw FileError(path, "is a directory");
    if (!fs::is_regular_file(target, error))
      throw FileError(path, "is not a regular file; it would be replaced by one");
    if (access(target.c_str(), W_OK) != 0)
      throw FileError(path, std::string("cannot be written: ") + std::strerror(errno));
  }
  if (!target.has_filename())
    throw FileError(path, "is a directory");
  if (std::any_of(files_.begin(), files_.end(), [&](const File& file) { return file.target == target; }))
    throw UsageError("'" + path + "' is asked for twice");

  const std::string temporary = (target.parent_path() / ("." + target.stem().string() + "." + std::to_string(getpid()) +
                                                         ".part" + target.extension().string()))
                                    .string();
  const int descriptor = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0)
    throw FileError(path, std::string("cannot be written: ") + std::strerror(errno));
  close(descriptor);
  files_.push_back({path, target.string(), temporary});
}

std::int64_t OutputFiles::write(const std::string& path, const std::function<void(const std::string&)>& writer)
{
  const auto file = std::find_if(files_.begin(), files_.end(), [&](const File& f) { return f.path == path; });
  if (file == files_.end())
    throw FileError(path, "was not declared as an output");
  try {
    writer(file->temporary);
  } catch (const FileError& failure) {
    throw FileError(path, failure.what());
  }
  struct stat status;
  if (stat(file->temporary.c_str(), &status) != 0 || status.st_size == 0)
    // VTK removes what it could not finish.
    throw FileError(path, "could not be written; is the disk full?");
  return status.st_size;
}

void OutputFiles::publish()
{
  while (!files_.empty()) {
    const File& file = files_.back();
    if (std::rename(file.temporary.c_str(), file.target.c_str()) != 0)
      throw FileError(file.path, std::string("cannot be written: ") + std::strerror(errno));
    files_.pop_back();
  }
}

} // namespace mrf_apps

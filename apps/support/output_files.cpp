// SPDX-License-Identifier: BSD-3-Clause
#include "output_files.h"

#include "errors.h"
#include "temporary_files.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

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
      if (!input.empty() && !output.empty() && output != "-" && (input == output || sameFile(input, output)))
        throw UsageError("'" + output + "' is an input and would be overwritten");
}

namespace {

/// What messages call an output.
std::string told(const std::string& path)
{
  return path == "-" ? "standard output" : path;
}

/// A name beside the target that no file has yet.
std::string temporaryName(const fs::path& target, int attempt)
{
  const std::string number = std::to_string(getpid()) + (attempt > 0 ? "-" + std::to_string(attempt) : "");
  return (target.parent_path() / ("." + target.stem().string() + "." + number + ".part" + target.extension().string()))
      .string();
}

/// Where a path leads that may be a link to a file that does not exist yet.
fs::path followLinks(fs::path path)
{
  constexpr int max = 40; // as the kernel
  std::error_code error;
  for (int i = 0; i < max && fs::is_symlink(fs::symlink_status(path, error)); ++i) {
    const fs::path next = fs::read_symlink(path, error);
    if (error)
      break;
    path = path.parent_path() / next; // the second alone if it is absolute
  }
  return path;
}

/// True if this process may open one more file.
bool isDescriptorLeft()
{
  const int descriptor = open("/", O_RDONLY | O_CLOEXEC);
  if (descriptor >= 0)
    close(descriptor);
  return descriptor >= 0;
}

/// What the system says to writing more at the end of a file; empty if it can be done. A writer that has failed may
/// not know. \param descriptor −1: nothing is known
std::string whyNotWritable(int descriptor)
{
  struct stat status;
  if (fstat(descriptor, &status) != 0)
    return {};
  const std::vector<char> block(1 << 16);
  for (off_t written = 0; written < static_cast<off_t>(block.size());) {
    const ssize_t count = pwrite(descriptor, block.data(), block.size(), status.st_size + written);
    if (count <= 0)
      return std::strerror(count < 0 ? errno : ENOSPC);
    written += count;
  }
  return {};
}

} // namespace

/// One file on its way.
class OutputFiles::File {
public:
  /// \param mayBeUnnamed false: descriptors are scarce \throw FileError
  File(const std::string& path, const fs::path& target, bool mayBeUnnamed) : path_(path), target_(target)
  {
    if (!mayBeUnnamed || !openUnnamed())
      createNamed();
  }
  File(File&& other) noexcept
      : path_(std::move(other.path_)), target_(std::move(other.target_)), name_(std::move(other.name_)),
        descriptor_(other.descriptor_)
  {
    other.descriptor_ = -1;
  }
  File& operator=(File&&) = delete;
  ~File()
  {
    if (descriptor_ >= 0)
      close(descriptor_);
  }

  const std::string& path() const { return path_; }
  const std::string& target() const { return target_; }
  /// To be opened for writing.
  std::string temporary() const { return name_ ? name_->path() : "/proc/self/fd/" + std::to_string(descriptor_); }

  /// Of a file without a name; −1: it has one.
  int descriptor() const { return descriptor_; }

  bool isStandardOutput() const { return path_ == "-"; }

  void publish()
  {
    if (isStandardOutput())
      return copyToStandardOutput();
    if (!name_)
      giveName();
    if (std::rename(name_->path().c_str(), target_.c_str()) != 0)
      fail();
    name_->release();
  }

private:
  [[noreturn]] void fail() const
  {
    throw FileError(told(path_), std::string("cannot be written: ") + std::strerror(errno));
  }

  void copyToStandardOutput() const
  {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(temporary().c_str(), "rb"), &std::fclose);
    if (!file)
      fail();
    std::vector<char> block(1 << 16);
    while (const std::size_t count = std::fread(block.data(), 1, block.size(), file.get()))
      if (std::fwrite(block.data(), 1, count, stdout) != count)
        fail();
    if (std::ferror(file.get()) != 0 || std::fflush(stdout) != 0)
      fail();
  }

  bool openUnnamed()
  {
    const std::string folder = fs::path(target_).parent_path().string();
    descriptor_ = open(folder.c_str(), O_WRONLY | O_TMPFILE | O_CLOEXEC, 0666);
    if (descriptor_ < 0)
      return false;
    // What is opened again through its number leaves one descriptor at least for other files.
    if (access(temporary().c_str(), W_OK) == 0 && isDescriptorLeft())
      return true;
    close(descriptor_);
    descriptor_ = -1;
    return false;
  }

  void createNamed()
  {
    tryNames([](const std::string& name) {
      const int descriptor = open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (descriptor >= 0)
        close(descriptor);
      return descriptor >= 0;
    });
  }

  void giveName()
  {
    const std::string unnamed = temporary();
    tryNames([&](const std::string& name) {
      return linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
    });
  }

  /// Calls create(name) until it succeeds, with a name that nobody has; a file of a process that crashed may have one.
  template <typename Create>
  void tryNames(const Create& create)
  {
    constexpr int attempts = 100;
    for (int attempt = 0; attempt < attempts; ++attempt) {
      const std::string name = temporaryName(target_, attempt);
      // Before there is a file, so that no signal finds one that is not known.
      TemporaryName known(name);
      if (create(name)) {
        name_.emplace(std::move(known));
        return;
      }
      known.release(); // it is somebody else's
      if (errno != EEXIST)
        break;
    }
    fail();
  }

  std::string path_, target_;
  std::optional<TemporaryName> name_; ///< none: the file has no name yet
  int descriptor_ = -1;               ///< of a file without a name
};

OutputFiles::OutputFiles() = default;
OutputFiles::~OutputFiles() = default;

void OutputFiles::add(const std::string& path)
{
  std::error_code error;
  if (path == "-") {
    if (std::any_of(files_.begin(), files_.end(), [](const File& file) { return file.isStandardOutput(); }))
      throw UsageError("standard output is asked for twice");
    files_.emplace_back(path, fs::temp_directory_path() / "standard-output", true);
    return;
  }
  // Renaming would replace a symbolic link by the file instead of writing where it leads.
  const fs::path target = fs::weakly_canonical(followLinks(fs::absolute(path, error)), error);
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
  if (std::any_of(files_.begin(), files_.end(), [&](const File& file) { return file.target() == target; }))
    throw UsageError("'" + path + "' is asked for twice");
  // A scan may have a file for each of hundreds of views.
  constexpr std::size_t maxDescriptors = 16;
  files_.emplace_back(path, target, files_.size() < maxDescriptors);
}

std::int64_t OutputFiles::write(const std::string& path, const std::function<void(const std::string&)>& writer)
{
  const auto file = std::find_if(files_.begin(), files_.end(), [&](const File& f) { return f.path() == path; });
  if (file == files_.end())
    throw FileError(path, "was not declared as an output");
  const std::string temporary = file->temporary();
  // Kept open: VTK removes what it could not finish, and with it the reason.
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> kept(nullptr, &std::fclose);
  int descriptor = file->descriptor();
  if (descriptor < 0 && isDescriptorLeft()) {
    kept.reset(std::fopen(temporary.c_str(), "ab"));
    if (!isDescriptorLeft())
      kept.reset();
    descriptor = kept ? fileno(kept.get()) : -1;
  }
  const auto fail = [&](const std::string& cause) {
    const std::string reason = whyNotWritable(descriptor);
    throw FileError(told(path), reason.empty() ? cause : "could not be written: " + reason);
  };
  try {
    writer(temporary);
  } catch (const FileError& failure) {
    fail(failure.what());
  }
  struct stat status;
  if (stat(temporary.c_str(), &status) != 0 || status.st_size == 0)
    fail("could not be written; is the disk full?");
  return status.st_size;
}

void OutputFiles::publish()
{
  // First, because its reader may have gone; the others have been seen to be writable.
  for (File& file : files_)
    if (file.isStandardOutput())
      file.publish();
  while (!files_.empty()) {
    if (!files_.back().isStandardOutput())
      files_.back().publish();
    files_.pop_back();
  }
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "base/byte_writer.h"
#include "base/text.h"
#include "tiles/do_task.h"

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/execution.h>

#include <boost/functional/hash.hpp>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

namespace pcl::mrf {
namespace {

namespace fs = std::filesystem;

constexpr const char* journalName = "pcl_mrf_journal.txt";
constexpr const char* extension = ".result";
/// The journal's line if the directory was created for it; the directory is then removed with the results.
constexpr const char* ofOwn = "directory 0";
/// First word of the journal's line with the bytes of memory that the run may take.
constexpr const char* ofMemory = "memory";

/// Bytes of a result per byte of its input, about. More would refuse runs with enough room, less begins runs in vain.
constexpr double resultOfInput = .15;

/// The checksum of some texts one after the other, word by word: Boost's CRC, byte by byte, took 4 % of a run of three
/// million points without remeshing.
std::uint64_t checksum(std::initializer_list<std::string_view> texts)
{
  std::size_t sum = 0;
  for (const std::string_view text : texts) {
    boost::hash_combine(sum, text.size());
    for (std::size_t at = 0; at < text.size(); at += sizeof(std::uint64_t)) {
      std::uint64_t word = 0;
      std::memcpy(&word, text.data() + at, std::min(sizeof(word), text.size() - at));
      boost::hash_combine(sum, word);
    }
  }
  return sum;
}

std::string hexadecimal(std::uint64_t number)
{
  std::array<char, 17> digits;
  std::snprintf(digits.data(), digits.size(), "%016llx", static_cast<unsigned long long>(number));
  return digits.data();
}

/// Reads a result, which follows the checksum of its file's name and itself. \return nothing if missing or corrupted
std::optional<std::string> readResult(const fs::path& path)
{
  std::error_code error;
  std::uint64_t expected = 0;
  const std::uintmax_t size = fs::is_regular_file(path, error) ? fs::file_size(path, error) : 0;
  std::ifstream file(path, std::ios::binary);
  if (error || size < sizeof(expected) || !file.read(reinterpret_cast<char*>(&expected), sizeof(expected)))
    return {};
  std::string bytes(size - sizeof(expected), '\0');
  if (!file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())) ||
      checksum({path.filename().string(), bytes}) != expected)
    return {};
  return bytes;
}

void writeResult(const fs::path& path, const std::string& bytes)
{
  try {
    writeWhole(path, [&](const std::string& temporary) {
      ByteWriter writer(temporary);
      writer.value(checksum({path.filename().string(), bytes}));
      writer.text(bytes);
      writer.close();
    });
  } catch (const std::exception& error) {
    throw ResourceLimit("the result '" + path.string() + "' " + error.what() + "; make room: those before it are kept");
  }
}

} // namespace

TaskDirectory::TaskDirectory(std::string directory, bool resume, TaskRunner* inner)
    : directory_(std::move(directory)), inner_(inner)
{
  std::error_code error;
  isOwn_ = fs::create_directories(directory_, error);
  journal_ = open((fs::path(directory_) / journalName).c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  const auto refuse = [this](const std::string& why) {
    if (journal_ >= 0)
      close(journal_);
    throw FileError("the work directory '" + directory_ + "' " + why);
  };
  if (journal_ < 0)
    refuse("cannot be written to: " + (error ? error.message() : std::strerror(errno)) + "; give another one");
  if (flock(journal_, LOCK_EX | LOCK_NB) != 0)
    refuse("is in use by another run");
  std::ifstream journal(fs::path(directory_) / journalName);
  for (std::string line; std::getline(journal, line);) {
    std::istringstream words(line);
    words >> line;
    if (words.str() == ofOwn)
      isOwn_ = true;
    else if (line == ofMemory)
      words >> memory_;
    else
      hasResults_ = true;
  }
  if (hasResults_ && !resume)
    refuse("has results of an earlier run: go on with it (--resume), or give another one");
  for (const fs::directory_entry& entry : fs::directory_iterator(directory_, error))
    if (entry.path().stem().stem().extension() == extension && entry.path().extension() == ".part")
      fs::remove(entry, error); // what a run was writing when it was killed
  if (isOwn_ && lseek(journal_, 0, SEEK_END) == 0)
    isOwn_ = append(ofOwn);
}

TaskDirectory::~TaskDirectory()
{
  if (!hasResults_)
    remove(); // there is nothing to resume
  close(journal_);
}

bool TaskDirectory::append(const std::string& line)
{
  const std::string text = line + "\n";
  return write(journal_, text.data(), text.size()) == static_cast<ssize_t>(text.size());
}

void TaskDirectory::note(const std::string& line)
{
  if (!append(line))
    throw ResourceLimit("the journal of the work directory '" + directory_ +
                        "' cannot be written: " + std::strerror(errno));
}

std::size_t TaskDirectory::memory(std::size_t now)
{
  if (memory_ == 0) {
    memory_ = now;
    note(ofMemory + (" " + std::to_string(now)));
  }
  return memory_;
}

void TaskDirectory::requireRoom(const std::string& kind, double bytes) const
{
  std::error_code error;
  const auto free = static_cast<double>(fs::space(directory_, error).available);
  for (const fs::directory_entry& entry : fs::directory_iterator(directory_, error))
    if (entry.path().filename().string().rfind(kind + "-", 0) == 0 &&
        std::find(used_.begin(), used_.end(), entry.path().string()) == used_.end())
      bytes -= static_cast<double>(entry.file_size(error)); // this result may be used
  if (error || free >= bytes)
    return;
  throw ResourceLimit(textOf(3, "results in the work directory '", directory_, "' would take some ", bytes / 1e9,
                             " GB more, and ", free / 1e9, " are free; make room: what is there is kept"));
}

void TaskDirectory::run(const std::string& kind, int count, const MakeInput& makeInput, const UseResult& useResult,
                        Execution& execution)
{
  std::vector<fs::path> files(count);
  int done = 0;
  bool isMeasured = false;
  const auto makeMissing = [&](int n) -> std::optional<std::string> {
    std::optional<std::string> input = makeInput(n);
    if (!input)
      return input;
    if (n == 0)
      requireRoom(kind, resultOfInput * count * static_cast<double>(input->size()));
    const std::string name = hexadecimal(checksum({MRF_VERSION, kind, *input})) + "-" + std::to_string(input->size());
    fs::path& file = files[n];
    file = fs::path(directory_) / (kind + "-" + name + extension);
    if (!readResult(file)) // read again when its turn comes: ranks ask for many inputs in advance
      return input;
    ++found_;
    used_.push_back(file.string());
    return {};
  };
  const auto keep = [&](int n, std::string result) {
    const fs::path& file = files[n];
    if (!result.empty()) {
      writeResult(file, result);
      used_.push_back(file.string());
      note(file.filename().string() + " " + std::to_string(result.size()));
      hasResults_ = true;
      ++made_;
      if (!std::exchange(isMeasured, true)) // now it is known how large results are
        requireRoom(kind, static_cast<double>(result.size()) * (count - done - 1));
    } else if (!file.empty()) {
      std::optional<std::string> read = readResult(file);
      if (!read)
        throw ResourceLimit("the result '" + file.string() + "' has changed while it was used");
      result = *std::move(read);
    }
    ++done;
    useResult(n, std::move(result));
  };
  OneProcess here;
  (inner_ ? *inner_ : here).run(kind, count, makeMissing, keep, execution);
}

void TaskDirectory::remove()
{
  std::error_code ignored;
  for (const std::string& file : used_)
    fs::remove(file, ignored);
  used_.clear();
  for (const fs::directory_entry& entry : fs::directory_iterator(directory_, ignored))
    if (entry.path().extension() == extension)
      return; // it is of another run
  fs::remove(fs::path(directory_) / journalName, ignored);
  if (isOwn_)
    fs::remove(directory_, ignored); // if it is empty
}

} // namespace pcl::mrf

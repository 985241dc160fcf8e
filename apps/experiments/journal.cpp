// SPDX-License-Identifier: BSD-3-Clause
#include "journal.h"

#include "support/errors.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace mrf_apps {

using nlohmann::json;

Journal::Journal(const std::string& path, JournalOrigin origin, bool isFresh) : path_(path), origin_(std::move(origin))
{
  descriptor_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor_ < 0)
    throw FileError(path, std::string("cannot be written: ") + std::strerror(errno));
  try {
    // Two runs would interleave their lines and each cut off what the other one writes.
    if (flock(descriptor_, LOCK_EX | LOCK_NB) != 0)
      throw FileError(path, "is in use by another run");
    if (isFresh && ftruncate(descriptor_, 0) != 0)
      throw FileError(path, std::string("cannot be written: ") + std::strerror(errno));
    load();
  } catch (...) {
    close(descriptor_);
    throw;
  }
}

Journal::~Journal()
{
  close(descriptor_);
}

void Journal::load()
{
  std::string text;
  char block[1 << 16];
  ssize_t count;
  while ((count = read(descriptor_, block, sizeof block)) > 0)
    text.append(block, static_cast<std::size_t>(count));
  if (count < 0)
    throw FileError(path_, std::strerror(errno));
  const std::size_t end = text.rfind('\n');
  text.resize(end == std::string::npos ? 0 : end + 1);
  const auto size = static_cast<off_t>(text.size());
  if (ftruncate(descriptor_, size) != 0 || lseek(descriptor_, size, SEEK_SET) != size)
    throw FileError(path_, std::string("cannot be written: ") + std::strerror(errno));

  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t length = rest.find('\n');
    const json line = json::parse(rest.substr(0, length), nullptr, false);
    rest.remove_prefix(length + 1);
    // A damaged line costs no more than measuring again.
    if (!line.is_object())
      continue;
    if (line.contains("picture") && line["picture"].is_string())
      pictures_[line["picture"]] = isOwn(line);
    else if (line.contains("key") && line["key"].is_string() && line.contains("result") && isOwn(line))
      results_[line["key"]] = line["result"];
  }
}

bool Journal::isOwn(const json& line) const
{
  const auto is = [&](const char* name, const json& value) { return line.contains(name) && line[name] == value; };
  return is("seed", origin_.seed) && is("quick", origin_.quick) && is("build", origin_.build);
}

const json* Journal::find(const std::string& key) const
{
  const auto found = results_.find(key);
  return found == results_.end() ? nullptr : &found->second;
}

void Journal::add(const std::string& key, const json& result)
{
  append({{"key", key}, {"result", result}});
  results_[key] = result;
}

bool Journal::isOwnPicture(const std::string& file) const
{
  const auto found = pictures_.find(file);
  return found != pictures_.end() && found->second;
}

void Journal::addPicture(const std::string& file)
{
  append({{"picture", file}});
  pictures_[file] = true;
}

void Journal::append(json line)
{
  line.update({{"seed", origin_.seed}, {"quick", origin_.quick}, {"build", origin_.build}});
  const std::string text = line.dump(-1, ' ', false, json::error_handler_t::replace) + "\n";
  for (std::string_view rest = text; !rest.empty();) {
    const ssize_t written = write(descriptor_, rest.data(), rest.size());
    if (written < 0 && errno != EINTR)
      throw FileError(path_, std::string("cannot be written: ") + std::strerror(errno));
    rest.remove_prefix(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
  }
  fdatasync(descriptor_);
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Results that outlive an interrupted run: one JSON line each, appended as it is measured.
#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace mrf_apps {

/// What results depend on beside their keys.
struct JournalOrigin {
  std::uint64_t seed = 1;
  bool quick = false;
  std::string build; ///< of the program, see build_identity.h
};

/// An append-only file that one process at a time writes to.
class Journal {
public:
  /// Opens the file or makes it. A last line without its end is cut off: the run that wrote it was interrupted. Lines
  /// of other origins are kept and not read.
  /// \param isFresh forget all that is there
  /// \throw FileError if the file cannot be written or another process has it
  Journal(const std::string& path, JournalOrigin origin, bool isFresh);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Null if the key is not there.
  const nlohmann::json* find(const std::string& key) const;

  /// On disk when this returns, as far as the system promises. \throw FileError
  void add(const std::string& key, const nlohmann::json& result);

  /// True if the last line about this file, by any run, is of this origin: the file is what it drew.
  bool isOwnPicture(const std::string& file) const;
  void addPicture(const std::string& file);

private:
  void load();
  void append(nlohmann::json line);
  bool isOwn(const nlohmann::json& line) const;

  std::string path_;
  JournalOrigin origin_;
  int descriptor_ = -1;
  std::map<std::string, nlohmann::json> results_;
  std::map<std::string, bool> pictures_; ///< true: own
};

} // namespace mrf_apps

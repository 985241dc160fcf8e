// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Temporary files with names, and their end when a signal ends the process.
#pragma once

#include <string>

namespace mrf_apps {

/// The name of a temporary file that is removed with the object, or when a signal ends the process.
class TemporaryName {
public:
  explicit TemporaryName(const std::string& path);
  TemporaryName(TemporaryName&& other) noexcept : entry_(other.entry_) { other.entry_ = nullptr; }
  TemporaryName& operator=(TemporaryName&& other) noexcept;
  ~TemporaryName();

  const std::string& path() const;

  /// The file has another name now: there is nothing to remove any more.
  void release();

  struct Entry; ///< in the list that the handlers of signals go through

private:
  Entry* entry_;
};

/// From now on a signal that ends the process removes the temporary files first. Signals that are ignored stay so.
/// A reader of the standard output that goes away, and files beyond the limit of their size, are errors of the writing
/// call instead of the end of the process.
void removeTemporaryFilesOnSignals();

/// Handler of a signal: removes the temporary files, then does what the signal does by default.
void endBySignal(int signal);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "temporary_files.h"

#include <atomic>
#include <csignal>
#include <mutex>

#include <unistd.h>

namespace mrf_apps {

/// Entries are never freed, only used again, so that a handler may go through them at any time.
struct TemporaryName::Entry {
  std::string path;
  std::atomic<bool> isUsed{false}; ///< there may be a file
  bool isTaken = false;            ///< by an object
  Entry* next = nullptr;
};

namespace {

std::mutex entriesMutex;
std::atomic<TemporaryName::Entry*> entries{nullptr};

} // namespace

TemporaryName::TemporaryName(const std::string& path)
{
  const std::lock_guard<std::mutex> lock(entriesMutex);
  entry_ = entries;
  while (entry_ != nullptr && entry_->isTaken)
    entry_ = entry_->next;
  if (entry_ == nullptr) {
    entry_ = new Entry;
    entry_->next = entries;
    entries = entry_;
  }
  entry_->isTaken = true;
  entry_->path = path;
  entry_->isUsed = true;
}

TemporaryName& TemporaryName::operator=(TemporaryName&& other) noexcept
{
  std::swap(entry_, other.entry_);
  return *this;
}

TemporaryName::~TemporaryName()
{
  if (entry_ == nullptr)
    return;
  if (entry_->isUsed)
    unlink(entry_->path.c_str());
  release();
  const std::lock_guard<std::mutex> lock(entriesMutex);
  entry_->isTaken = false;
}

const std::string& TemporaryName::path() const
{
  return entry_->path;
}

void TemporaryName::release()
{
  entry_->isUsed = false;
}

void endBySignal(int signal)
{
  for (const TemporaryName::Entry* entry = entries; entry != nullptr; entry = entry->next)
    if (entry->isUsed)
      unlink(entry->path.c_str());
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
  // Not ignored, because programs that are started would ignore them as well.
  for (const int signal : {SIGPIPE, SIGXFSZ})
    std::signal(signal, [](int) {});
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "tiles/ranks.h"

#include "base/module.h"
#include "tiles/do_task.h"

#include <pcl/surface/mrf/exceptions.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <thread>
#include <utility>

namespace pcl::mrf {
namespace {

enum Tag { buildTag = 1, kindTag, threadsTag, inputTag, endTag, resultTag, errorTag };

/// Time between two probes for a message: a thousandth of what a task takes.
constexpr std::chrono::milliseconds pause(1);

std::string received(const MessagePassing& passing, const Message& message)
{
  std::string bytes(message.bytes, '\0');
  passing.receive(&message, bytes.data());
  return bytes;
}

void send(const MessagePassing& passing, int to, Tag tag, const std::string& bytes)
{
  passing.send(to, tag, bytes.data(), bytes.size());
}

/// An error as the bytes of a message: its status and its text.
std::string toMessage(const Error& error)
{
  return static_cast<char>(error.status()) + error.message();
}

[[noreturn]] void throwMessage(const std::string& message)
{
  const std::string text = message.substr(1);
  switch (static_cast<Status>(message.front())) {
  case Status::invalidInput:
    throw InvalidInput(text);
  case Status::invalidOption:
    throw InvalidOption(text);
  case Status::resourceLimit:
    throw ResourceLimit(text);
  case Status::solverFailure:
    throw SolverFailure(text);
  default:
    throw Error(Status::internalError, text);
  }
}

std::pair<Tag, std::string> answerOf(const std::string& kind, std::string input, Execution& execution)
{
  try {
    return {resultTag, doTask(kind, std::move(input), execution)};
  } catch (const Error& error) {
    return {errorTag, toMessage(error)};
  } catch (const std::bad_alloc&) {
    return {errorTag, toMessage(ResourceLimit("out of memory, on another rank; choose a larger voxel size"))};
  } catch (const std::exception& error) {
    return {errorTag, toMessage(Error(Status::internalError, error.what()))};
  }
}

/// A hash of the file that holds this code: ranks that run another build would make other results.
std::string buildOfThis()
{
  Dl_info found{};
  dladdr(reinterpret_cast<const void*>(&serveRanks), &found);
  std::ifstream file(found.dli_fname == nullptr ? "" : found.dli_fname, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return std::to_string(std::hash<std::string>()(bytes));
}

} // namespace

/// All tasks of one call of run().
class Ranks::Run {
public:
  Run(Ranks& ranks, const std::string& kind, int count, const MakeInput& makeInput, const UseResult& useResult,
      Execution& execution)
      : ranks_(ranks), passing_(ranks.passing_), kind_(kind), count_(count), makeInput_(makeInput),
        useResult_(useResult), execution_(execution),
        own_(std::max(1, execution.threads() / std::min(passing_.ranksOfMachine, count)), [this](auto&&...) {
          lookAfterOthers();
          execution_.poll();
          return true;
        })
  {
    own_.beginRun({}); // so that it calls back during its loops
  }

  ~Run()
  {
    for (const auto& entry : busy_)
      ranks_.forgotten_.insert(entry.first);
  }

  void run()
  {
    while (used_ < count_) {
      lookAfterOthers();
      if (next_ < count_) {
        const int task = next_++;
        std::optional<std::string> input = makeInput_(task);
        results_[task] = input ? doTask(kind_, *std::move(input), own_) : std::string();
      } else if (results_.find(used_) == results_.end()) {
        std::this_thread::sleep_for(pause);
        execution_.poll();
      }
      for (auto result = results_.find(used_); result != results_.end(); result = results_.find(++used_)) {
        useResult_(used_, std::move(result->second));
        results_.erase(result);
      }
    }
  }

private:
  void lookAfterOthers()
  {
    for (Message message; passing_.probe(&message) != 0;) {
      std::string answer = received(passing_, message);
      ranks_.idle_.push_back(message.from);
      if (ranks_.forgotten_.erase(message.from) > 0)
        continue;
      const int task = busy_.at(message.from);
      busy_.erase(message.from);
      if (message.tag == errorTag)
        throwMessage(answer);
      results_[task] = std::move(answer);
    }
    while (!ranks_.idle_.empty() && next_ < count_) {
      const int task = next_++;
      const std::optional<std::string> input = makeInput_(task);
      if (!input) {
        results_[task].clear();
        continue;
      }
      const int rank = ranks_.idle_.back();
      ranks_.idle_.pop_back();
      busy_[rank] = task;
      send(passing_, rank, threadsTag, std::to_string(own_.threads()));
      send(passing_, rank, kindTag, kind_);
      send(passing_, rank, inputTag, *input);
    }
  }

  Ranks& ranks_;
  const MessagePassing& passing_;
  const std::string& kind_;
  const int count_;
  const MakeInput& makeInput_;
  const UseResult& useResult_;
  Execution& execution_; ///< for making inputs
  Execution own_;        ///< for the tasks that this rank does
  int next_ = 0, used_ = 0;
  std::map<int, int> busy_;            ///< by rank: its task
  std::map<int, std::string> results_; ///< by task, until its turn comes
};

Ranks::Ranks(const MessagePassing& passing) : passing_(passing)
{
  const std::string build = buildOfThis();
  for (int rank = passing.ranks - 1; rank > 0; --rank) {
    idle_.push_back(rank);
    send(passing, rank, buildTag, build);
  }
}

Ranks::~Ranks()
{
  if (!forgotten_.empty())
    return;
  for (int rank = 1; rank < passing_.ranks; ++rank)
    send(passing_, rank, endTag, {});
  passing_.finish();
}

void Ranks::run(const std::string& kind, int count, const MakeInput& makeInput, const UseResult& useResult,
                Execution& execution)
{
  if (count > 0)
    Run(*this, kind, count, makeInput, useResult, execution).run();
}

void serveRanks(const MessagePassing& passing)
{
  std::optional<Execution> execution;
  std::string kind;
  for (;;) {
    Message message;
    if (passing.probe(&message) == 0) {
      std::this_thread::sleep_for(pause);
      continue;
    }
    std::string bytes = received(passing, message);
    if (message.tag == threadsTag)
      execution.emplace(std::stoi(bytes));
    else if (message.tag == buildTag && bytes != buildOfThis())
      throw ResourceLimit("rank " + std::to_string(passing.rank) +
                          " runs another build of the library than rank 0: install the same package on all machines");
    else if (message.tag == buildTag)
      continue;
    else if (message.tag == kindTag)
      kind = std::move(bytes);
    else if (message.tag == inputTag) {
      const auto [tag, answer] = answerOf(kind, std::move(bytes), *execution);
      send(passing, message.from, tag, answer);
    } else
      break;
  }
  passing.finish();
}

std::unique_ptr<TaskRunner> tasksOfRanks()
{
  const char* const ranks = std::getenv("OMPI_COMM_WORLD_SIZE");
  if (ranks != nullptr && std::string(ranks) == "1")
    return std::make_unique<OneProcess>(); // MPI, once begun, could not be begun again by the next run in a script
  void* const found = shownByModule(MRF_MPI_MODULE, messagePassingSymbol, RTLD_GLOBAL);
  const char* const local = std::getenv("OMPI_COMM_WORLD_LOCAL_RANK");
  if (found == nullptr && local != nullptr && std::string(local) != "0")
    return nullptr; // rank 0 of this machine reports it
  if (found == nullptr)
    throw ResourceLimit(std::string("several processes need ") + MRF_MPI_MODULE +
                        ", of the package " MRF_MPI_PACKAGE ", which cannot be loaded: " + dlerror() +
                        "; install it, or run without mpirun");
  const MessagePassing* const passing = reinterpret_cast<BeginMessagePassing*>(found)();
  if (passing == nullptr)
    throw ResourceLimit("MPI cannot be begun");
  if (passing->rank == 0)
    return std::make_unique<Ranks>(*passing);
  serveRanks(*passing);
  return nullptr;
}

} // namespace pcl::mrf

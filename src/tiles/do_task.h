// SPDX-License-Identifier: BSD-3-Clause
/// Tasks by the name of their kind, how large they are, and done by one process.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <optional>
#include <string>
#include <utility>

namespace pcl::mrf {

/// Unknowns of a tile, and triangles of a part of the mesh, that tasks have if there is a TaskRunner. More would leave
/// processes idle while the last ones are at work, and of less too much is done twice.
constexpr double unknownsPerTask = 7e5, trianglesPerTask = 2.5e5;

/// Does a task as forTasks has it done, from bytes to bytes. \throw what the task throws
std::string doTask(const std::string& kind, std::string input, Execution& execution);

/// Tasks done by this process, one after the other.
class OneProcess : public TaskRunner {
public:
  void run(const std::string& kind, int count, const MakeInput& makeInput, const UseResult& useResult,
           Execution& execution) override
  {
    for (int n = 0; n < count; ++n) {
      std::optional<std::string> input = makeInput(n);
      useResult(n, input ? doTask(kind, *std::move(input), execution) : std::string());
    }
  }
};

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// Doing tasks by the name of their kind, their size, and a TaskRunner of one process.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <optional>
#include <string>
#include <utility>

namespace pcl::mrf {

/// Size of tasks if there is a TaskRunner: unknowns of a tile, and triangles of a part of the mesh. Larger tasks would
/// leave processes idle while the last ones are at work, and smaller ones would do too much twice.
constexpr double unknownsPerTask = 7e5, trianglesPerTask = 2.5e5;

/// Does a task of forTasks() from bytes to bytes. \throw what the task throws
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

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Tasks done by this process, one after the other.
#pragma once

#include "tiles/do_task.h"

#include <pcl/surface/mrf/execution.h>

#include <optional>
#include <string>
#include <utility>

namespace pcl::mrf {

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

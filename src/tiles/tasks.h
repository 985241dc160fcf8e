// SPDX-License-Identifier: BSD-3-Clause
/// Parts of a run as tasks, which are done here at once or by a TaskRunner.
#pragma once

#include "tiles/archive.h"

#include <pcl/surface/mrf/execution.h>

#include <string>
#include <utility>

namespace pcl::mrf {

/// The function of a kind of task. \tparam Input, Output have serialize()
template <typename Input, typename Output>
using Task = Output(Input input, Execution& execution);

/// Does `count` tasks: use(n, task(makeInput(n))) for each n in turn.
/// \param kind under which doTask() of tiles/do_task.h knows the task \throw what a task throws; what TaskRunner::run
/// does
template <typename Input, typename Output, typename MakeInput, typename Use>
void forTasks(const char* kind, Task<Input, Output>* task, int count, const MakeInput& makeInput, const Use& use,
              Execution& execution)
{
  if (TaskRunner* const runner = execution.tasks())
    return runner->run(
        kind, count, [&](int n) { return toBytes(static_cast<const Input&>(makeInput(n))); },
        [&](int n, std::string result) { use(n, fromBytes<Output>(std::exchange(result, {}))); }, execution);
  for (int n = 0; n < count; ++n)
    use(n, task(makeInput(n), execution));
}

/// Does a task from bytes to bytes. The bytes of the input are freed before it begins.
template <typename Input, typename Output>
std::string doneAsBytes(Task<Input, Output>* task, std::string input, Execution& execution)
{
  auto value = fromBytes<Input>(input);
  std::string().swap(input);
  return toBytes(task(std::move(value), execution));
}

} // namespace pcl::mrf

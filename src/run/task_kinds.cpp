// SPDX-License-Identifier: BSD-3-Clause
#include "levels/tile_task.h"
#include "remesher/part_task.h"
#include "tiles/do_task.h"

#include <stdexcept>
#include <utility>

namespace pcl::mrf {

std::string doTask(const std::string& kind, std::string input, Execution& execution)
{
  if (kind == tileKind)
    return solveTile(std::move(input), execution);
  if (kind == partKind)
    return remeshPart(std::move(input), execution);
  throw std::logic_error("doTask: there is no kind " + kind);
}

} // namespace pcl::mrf

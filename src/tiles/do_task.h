// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Tasks by the name of their kind, and how large they are.
#pragma once

#include <pcl/surface/mrf/execution.h>

#include <string>

namespace pcl::mrf {

/// Unknowns of a tile, and triangles of a part of the mesh, that tasks have if there is a TaskRunner. More would leave
/// processes idle while the last ones are at work, and of less too much is done twice.
constexpr double unknownsPerTask = 7e5, trianglesPerTask = 2.5e5;

/// Does a task as forTasks has it done, from bytes to bytes. \throw what the task throws
std::string doTask(const std::string& kind, std::string input, Execution& execution);

} // namespace pcl::mrf

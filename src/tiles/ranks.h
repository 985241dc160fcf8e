// SPDX-License-Identifier: BSD-3-Clause
/// Tasks done by several processes that pass messages.
#pragma once

#include "tiles/message_passing.h"

#include <pcl/surface/mrf/execution.h>

#include <set>
#include <string>
#include <vector>

namespace pcl::mrf {

/// The runner of rank 0. It gives each rank a task and does tasks itself, while it takes results from the other ranks
/// and gives them more. Results depend neither on the number of ranks nor on which is the fastest.
class Ranks : public TaskRunner {
public:
  /// \param passing outlives this
  explicit Ranks(const MessagePassing& passing);
  /// Ends the other ranks. After an error some may still be at work: then all are left to mpirun.
  ~Ranks() override;

  void run(const std::string& kind, int count, const MakeInput& makeInput, const UseResult& useResult,
           Execution& execution) override;

private:
  class Run;

  const MessagePassing& passing_;
  std::vector<int> idle_;   ///< ranks
  std::set<int> forgotten_; ///< ranks at work on tasks whose results are not wanted any more
};

/// Does tasks on a rank above 0 until rank 0's runner is destroyed. \throw ResourceLimit if rank 0 has another build
void serveRanks(const MessagePassing& passing);

} // namespace pcl::mrf

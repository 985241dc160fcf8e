// SPDX-License-Identifier: BSD-3-Clause
/// Tasks done by several processes that pass messages.
#pragma once

#include "tiles/message_passing.h"

#include <pcl/surface/mrf/execution.h>

#include <set>
#include <string>
#include <vector>

namespace pcl::mrf {

/// Rank 0's runner. It gives each rank a task, does one itself, and looks after the others in between; results depend
/// neither on how many ranks there are nor on which is the fastest.
class Ranks : public TaskRunner {
public:
  /// \param passing outlives this
  explicit Ranks(const MessagePassing& passing);
  /// Lets the other ranks end. After an error some may be at work still: then it leaves them to mpirun.
  ~Ranks() override;

  void run(const std::string& kind, int count, const MakeInput& makeInput, const UseResult& useResult,
           Execution& execution) override;

private:
  class Run;

  const MessagePassing& passing_;
  std::vector<int> idle_;   ///< ranks
  std::set<int> forgotten_; ///< ranks that do tasks which nobody waits for any more
};

/// What ranks above 0 do, until rank 0's runner has gone.
void serveRanks(const MessagePassing& passing);

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// Options as the stages that make the surface take them: with numbers in place of what was automatic.
#pragma once

#include <pcl/surface/mrf/options.h>

#include <utility>

namespace pcl::mrf {

/// Options of which no length is left automatic that follows from the cloud, and nothing that cross-validation chooses.
/// Only an OptionResolver makes them: a function that takes them cannot get a request by mistake.
///
/// What each level or the machine decides stays 0: the solver's iterations and degree, memory, threads. So do the
/// remesher's target edge, which follows from the mesh, and a radius of normals from a number of neighbors.
class ResolvedOptions : public Options {
public:
  /// What they were resolved from: some rules are stricter where a length was given than where it was derived.
  const Options& requested() const { return requested_; }

private:
  friend class OptionResolver;
  ResolvedOptions(const Options& resolved, Options requested) : Options(resolved), requested_(std::move(requested)) {}

  Options requested_;
};

} // namespace pcl::mrf

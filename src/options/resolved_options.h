// SPDX-License-Identifier: BSD-3-Clause
/// Options with numbers in place of automatic values, for the stages that make the surface.
#pragma once

#include <pcl/surface/mrf/options.h>

#include <utility>

namespace pcl::mrf {

/// Options in which every value that follows from the cloud or from cross-validation is resolved. Only an
/// OptionResolver makes them: a function that takes ResolvedOptions cannot get requested options by mistake.
///
/// Values that each level or the machine decides stay 0: the solver's iterations and degree, memory, threads. So do the
/// remesher's target edge, which follows from the mesh, and the radius of normals if a number of neighbors replaces it.
class ResolvedOptions : public Options {
public:
  /// The options before resolving: some rules are stricter for a length that was given than for a derived one.
  const Options& requested() const { return requested_; }

private:
  friend class OptionResolver;
  ResolvedOptions(const Options& resolved, Options requested) : Options(resolved), requested_(std::move(requested)) {}

  Options requested_;
};

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What a stage asks of its options.
#pragma once

#include <pcl/surface/mrf/options.h>

#include <string>

namespace pcl::mrf {

/// Checks every declared option, or those of one stage. \param stage such as "outliers"; empty: all
/// \throw InvalidOption naming the first one that is out of range, its value and the range
void requireDeclared(const Options& options, const std::string& stage = {});

/// Checks the options of one stage. \throw InvalidOption naming the first field that is out of range
void validate(const NormalOptions& options);
void validate(const OrientationOptions& options);
void validate(const ObservationOptions& options);
void validate(const PriorOptions& options);
void validate(const SolverOptions& options);
void validate(const MultiscaleOptions& options);
void validate(const TrimmingOptions& options);
void validate(const RemesherOptions& options);
void validate(const UncertaintyOptions& options);

} // namespace pcl::mrf

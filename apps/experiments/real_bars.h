// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Error bars of real clouds, against points that were withheld from them.
#pragma once

#include "experiment.h"

namespace mrf_apps {

/// Measures the clouds of `--only real` with default settings and the given normals. \return a row for each cloud's
/// random tenth, its discs, and both
Table realBars(Laboratory& laboratory);

} // namespace mrf_apps

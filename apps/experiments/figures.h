/// \file
/// \brief The experiments behind the paper's figures, each a section of the page.
#pragma once

#include "experiment.h"

namespace mrf_apps {

Section fig2(Laboratory& laboratory); ///< triangles before and after remeshing
Section fig9(Laboratory& laboratory); ///< reconstructions of the same points in several orientations

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The experiments behind the paper's figures, each a section of the page.
#pragma once

#include "experiment.h"

namespace mrf_apps {

Section fig2(Laboratory& laboratory);      ///< triangles before and after remeshing
Section fig3(Laboratory& laboratory);      ///< the three priors on tubes with a gap and on a collection of primitives
Section fig4(Laboratory& laboratory);      ///< confidence on the surface
Section fig5(Laboratory& laboratory);      ///< a large hole, filled by the three priors and by Poisson
Section fig9(Laboratory& laboratory);      ///< reconstructions of the same points in several orientations
Section section34(Laboratory& laboratory); ///< time and energy of the solvers
Section guide(Laboratory& laboratory);     ///< scans that call for an option, without and with it

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The experiments that compare methods and settings over many simulated scans, each a section of the page.
#pragma once

#include "experiment.h"

namespace mrf_apps {

Section table1(Laboratory& laboratory);     ///< leaving patches out, beside other methods
Section defaults(Laboratory& laboratory);   ///< one option at a time away from its default
Section fig8(Laboratory& laboratory);       ///< noise and outliers
Section real(Laboratory& laboratory);       ///< open, uneven clouds: points withheld from them, surface invented
Section errorBars(Laboratory& laboratory);  ///< how often and how narrowly sigma holds the true error
Section robustness(Laboratory& laboratory); ///< mesh checks over random scans

} // namespace mrf_apps

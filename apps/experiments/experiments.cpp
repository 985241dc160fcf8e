// SPDX-License-Identifier: BSD-3-Clause
#include "comparisons.h"
#include "experiment.h"
#include "figures.h"

namespace mrf_apps {

const std::vector<Experiment>& experiments()
{
  static const std::vector<Experiment> all = {
      {"fig-2", "Fig. 2: triangles before and after remeshing", fig2},
      {"fig-3", "Fig. 3: the priors on tubes and primitives", fig3},
      {"fig-4", "Fig. 4: confidence on the surface", fig4},
      {"fig-5", "Fig. 5: a large hole", fig5},
      {"table-1", "Table 1: leaving patches out, beside other methods", table1},
      {"real", "Real clouds: open, uneven, cluttered", real},
      {"fig-8", "Fig. 8: noise and outliers", fig8},
      {"uncertainty", "Error bars: how often they hold, how wide they are, how they rank", errorBars},
      {"robustness", "Meshes of random scans", robustness},
      {"fig-9", "Fig. 9: rotation", fig9},
      {"sec-3-4", "Sec. 3.4: time and energy of the solvers", section34},
      {"defaults", "Deciding the defaults", defaults},
      {"guide", "What the options are for", guide},
  };
  return all;
}

} // namespace mrf_apps

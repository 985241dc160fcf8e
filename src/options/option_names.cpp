// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/option_table.h>

namespace pcl::mrf {

const NamesOfAll& namesOfAll()
{
  static const NamesOfAll all(
      {{"density", LengthUnit::density}, {"nearest", LengthUnit::nearest}},
      {{"bins", SearchKind::bins}, {"kdtree", SearchKind::kdTree}},
      {{"membrane", Prior::membrane}, {"thin-plate", Prior::thinPlate}, {"triharmonic", Prior::triharmonic}},
      {{"joint", Energy::joint}, {"paper", Energy::paper}},
      {{"points", ObservationKind::points},
       {"median", ObservationKind::median},
       {"mean", ObservationKind::mean},
       {"nearest", ObservationKind::nearest},
       {"plane", ObservationKind::plane},
       {"trapezoid", ObservationKind::trapezoid}},
      {{"draft", Quality::draft}, {"normal", Quality::normal}, {"fine", Quality::fine}},
      {{"multigrid", SolverMethod::multigrid},
       {"icm", SolverMethod::icm},
       {"icm-colors", SolverMethod::icmColors},
       {"cg", SolverMethod::cg},
       {"cholesky", SolverMethod::cholesky}},
      {{"auto", NormalSource::automatic},
       {"use", NormalSource::use},
       {"reference", NormalSource::reference},
       {"estimate", NormalSource::estimate}},
      {{"none", OrientationVote::none},
       {"reference", OrientationVote::reference},
       {"sensor", OrientationVote::sensor},
       {"outward", OrientationVote::outward}},
      {{"none", Trimming::none}, {"holes", Trimming::holes}, {"supported", Trimming::supported}},
      {{"confidence", ColorMode::confidence},
       {"sigma", ColorMode::sigma},
       {"input", ColorMode::input},
       {"none", ColorMode::none}},
      {{"default", Preset::standard}, {"paper", Preset::paper}});
  return all;
}

} // namespace pcl::mrf

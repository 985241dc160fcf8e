// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/option_table.h>

namespace pcl::mrf {

template <>
const Names<LengthUnit>& names()
{
  static const Names<LengthUnit> all = {{"density", LengthUnit::density}, {"nearest", LengthUnit::nearest}};
  return all;
}

template <>
const Names<SearchKind>& names()
{
  static const Names<SearchKind> all = {{"bins", SearchKind::bins}, {"kdtree", SearchKind::kdTree}};
  return all;
}

template <>
const Names<Prior>& names()
{
  static const Names<Prior> all = {
      {"membrane", Prior::membrane}, {"thin-plate", Prior::thinPlate}, {"triharmonic", Prior::triharmonic}};
  return all;
}

template <>
const Names<Energy>& names()
{
  static const Names<Energy> all = {{"joint", Energy::joint}, {"paper", Energy::paper}};
  return all;
}

template <>
const Names<ObservationKind>& names()
{
  static const Names<ObservationKind> all = {
      {"points", ObservationKind::points}, {"median", ObservationKind::median},
      {"mean", ObservationKind::mean},     {"nearest", ObservationKind::nearest},
      {"plane", ObservationKind::plane},   {"trapezoid", ObservationKind::trapezoid}};
  return all;
}

template <>
const Names<Quality>& names()
{
  static const Names<Quality> all = {{"draft", Quality::draft}, {"normal", Quality::normal}, {"fine", Quality::fine}};
  return all;
}

template <>
const Names<SolverMethod>& names()
{
  static const Names<SolverMethod> all = {{"multigrid", SolverMethod::multigrid},
                                          {"icm", SolverMethod::icm},
                                          {"icm-colors", SolverMethod::icmColors},
                                          {"cg", SolverMethod::cg},
                                          {"cholesky", SolverMethod::cholesky}};
  return all;
}

template <>
const Names<NormalSource>& names()
{
  static const Names<NormalSource> all = {{"auto", NormalSource::automatic},
                                          {"use", NormalSource::use},
                                          {"reference", NormalSource::reference},
                                          {"estimate", NormalSource::estimate}};
  return all;
}

template <>
const Names<OrientationVote>& names()
{
  static const Names<OrientationVote> all = {{"none", OrientationVote::none},
                                             {"reference", OrientationVote::reference},
                                             {"sensor", OrientationVote::sensor},
                                             {"outward", OrientationVote::outward}};
  return all;
}

template <>
const Names<Trimming>& names()
{
  static const Names<Trimming> all = {
      {"none", Trimming::none}, {"holes", Trimming::holes}, {"supported", Trimming::supported}};
  return all;
}

template <>
const Names<ColorMode>& names()
{
  static const Names<ColorMode> all = {{"confidence", ColorMode::confidence},
                                       {"sigma", ColorMode::sigma},
                                       {"input", ColorMode::input},
                                       {"none", ColorMode::none}};
  return all;
}

template <>
const Names<Preset>& names()
{
  static const Names<Preset> all = {{"default", Preset::standard}, {"paper", Preset::paper}};
  return all;
}

} // namespace pcl::mrf

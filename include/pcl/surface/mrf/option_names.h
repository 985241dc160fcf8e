// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The words by which messages, command lines and reports call the values of the options.
#pragma once

#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/options.h>

#include <string>
#include <utility>
#include <vector>

namespace pcl {
namespace mrf {

template <typename Enum>
using Names = std::vector<std::pair<std::string, Enum>>;

/// All values of an enumeration with their names, in the order of the help.
template <typename Enum>
const Names<Enum>& names();

template <>
PCL_MRF_EXPORT const Names<LengthUnit>& names();
template <>
PCL_MRF_EXPORT const Names<Prior>& names();
template <>
PCL_MRF_EXPORT const Names<Energy>& names();
template <>
PCL_MRF_EXPORT const Names<ObservationKind>& names();
template <>
PCL_MRF_EXPORT const Names<ConfidenceShape>& names();
template <>
PCL_MRF_EXPORT const Names<Quality>& names();
template <>
PCL_MRF_EXPORT const Names<Interpolation>& names();
template <>
PCL_MRF_EXPORT const Names<SolverMethod>& names();
template <>
PCL_MRF_EXPORT const Names<NormalSource>& names();
template <>
PCL_MRF_EXPORT const Names<OrientationVote>& names();
template <>
PCL_MRF_EXPORT const Names<CellDecomposition>& names();
template <>
PCL_MRF_EXPORT const Names<Trimming>& names();
template <>
PCL_MRF_EXPORT const Names<ColorMode>& names();
template <>
PCL_MRF_EXPORT const Names<Preset>& names();

template <typename Enum>
std::string nameOf(Enum value)
{
  for (const auto& [name, candidate] : names<Enum>())
    if (candidate == value)
      return name;
  return "?";
}

} // namespace mrf
} // namespace pcl

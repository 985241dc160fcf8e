/// \file
/// \brief The words by which messages, command lines and reports call the values of the options.
#pragma once

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
const Names<LengthUnit>& names();
template <>
const Names<Prior>& names();
template <>
const Names<Energy>& names();
template <>
const Names<Estimate>& names();
template <>
const Names<ConfidenceShape>& names();
template <>
const Names<Quality>& names();
template <>
const Names<Interpolation>& names();
template <>
const Names<SolverMethod>& names();
template <>
const Names<NormalSource>& names();
template <>
const Names<OrientationVote>& names();
template <>
const Names<CellDecomposition>& names();
template <>
const Names<Trimming>& names();
template <>
const Names<ColourMode>& names();

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

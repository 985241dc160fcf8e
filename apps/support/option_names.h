/// \file
/// \brief The words by which the command line and the reports call the values of the options.
#pragma once

#include <pcl/surface/mrf/options.h>

#include <string>
#include <utility>
#include <vector>

namespace mrf_apps {

template <typename Enum>
using Names = std::vector<std::pair<std::string, Enum>>;

/// All values of an enumeration with their names, in the order of the help.
template <typename Enum>
const Names<Enum>& names();

template <>
const Names<pcl::mrf::LengthUnit>& names();
template <>
const Names<pcl::mrf::Prior>& names();
template <>
const Names<pcl::mrf::Energy>& names();
template <>
const Names<pcl::mrf::Estimate>& names();
template <>
const Names<pcl::mrf::ConfidenceShape>& names();
template <>
const Names<pcl::mrf::Quality>& names();
template <>
const Names<pcl::mrf::Interpolation>& names();
template <>
const Names<pcl::mrf::SolverMethod>& names();
template <>
const Names<pcl::mrf::NormalSource>& names();
template <>
const Names<pcl::mrf::OrientationVote>& names();
template <>
const Names<pcl::mrf::CellDecomposition>& names();
template <>
const Names<pcl::mrf::Trimming>& names();
template <>
const Names<pcl::mrf::ColourMode>& names();

template <typename Enum>
std::string nameOf(Enum value)
{
  for (const auto& [name, candidate] : names<Enum>())
    if (candidate == value)
      return name;
  return "?";
}

} // namespace mrf_apps

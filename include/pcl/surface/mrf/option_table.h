// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Every option of a reconstruction declared once: its name, unit, range, default and help, and names of values.
#pragma once

#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/options.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

namespace pcl::mrf {

/// The range of numbers that an option accepts.
struct PCL_MRF_EXPORT OptionRange {
  double lower = 0, upper = std::numeric_limits<double>::infinity();
  bool lowerOpen = false, upperOpen = false;

  /// False for numbers that are not finite.
  bool contains(double value) const;
  /// "[0, 1)", or "> 0" if there is no upper end.
  std::string text() const;
};

/// The value of an option as the member of Options has it: a switch, a word, an integer or a real number.
using OptionValue = std::variant<bool, std::string, std::int64_t, std::uint64_t, double>;

/// One option, as validation, command lines, manuals, reports and tests need it.
struct PCL_MRF_EXPORT OptionDeclaration {
  std::string name;      ///< member of Options, as in messages and reports, such as "prior.beta"
  std::string flag;      ///< flag of the command line, such as "--beta"
  std::string setter;    ///< setter of pcl::MRFReconstruction, such as "setBeta"; empty: setOptions
  std::string unit;      ///< unit of a number, such as "length", "degrees" or "share"
  OptionRange range;     ///< range of a number, in this unit; an automatic 0 may be outside of it
  bool isWhole = false;  ///< true: a number must be whole
  std::string automatic; ///< what 0 stands for if 0 is automatic; else empty
  std::vector<std::pair<std::string, double>> words; ///< of an enumeration or a switch, with their values; else empty
  std::string help;                                  ///< help text, without range and default

  std::function<double(const Options&)> get;        ///< value in `unit`, or as in `words`
  std::function<OptionValue(const Options&)> exact; ///< value in the member's own unit: bytes where `unit` is MiB
  /// \return false, and the options unchanged, if the member cannot hold the value within the range: in single
  /// precision 1e39 is infinite and .999999999 is 1
  std::function<bool(Options&, double)> set;

  bool isNumber() const { return words.empty(); }
  bool accepts(double value) const;

  /// The end of the error message, after "is": "outside its range [0, 1)", or "none of on, off".
  std::string refusal() const;

  /// The default as text: a number, a word, or what 0 stands for.
  std::string defaultText() const;

  /// A value of the option as text, for messages and help.
  std::string textOf(double value) const;
};

/// All numbers, enumerations and switches of Options, stage by stage.
PCL_MRF_EXPORT const std::vector<OptionDeclaration>& optionDeclarations();

/// \throw std::out_of_range if there is no option of this name
PCL_MRF_EXPORT const OptionDeclaration& optionDeclaration(const std::string& name);

/// How options are named: "prior.beta", "--beta" or "setBeta".
enum class OptionNaming { members, flags, setters };

/// Renames the options in a message of the library, which names them as Options does ("prior.beta = 2 is outside its
/// range"); also RawCloud::sensors and views.
/// \return the message in the words of a command line ("--beta 2 is outside ...") or of pcl::MRFReconstruction
/// ("setBeta(2) is outside ...")
PCL_MRF_EXPORT std::string withOptionNames(const std::string& message, OptionNaming naming);

/// Shortest decimal text of a number in single precision.
PCL_MRF_EXPORT std::string decimalText(double value);

/// \name The words by which messages, command lines and reports call the values of the options
/// @{
template <typename Enum>
using Names = std::vector<std::pair<std::string, Enum>>;

using NamesOfAll = std::tuple<Names<LengthUnit>, Names<SearchKind>, Names<Prior>, Names<Energy>, Names<ObservationKind>,
                              Names<Quality>, Names<SolverMethod>, Names<NormalSource>, Names<OrientationVote>,
                              Names<Trimming>, Names<ColorMode>, Names<Preset>>;
PCL_MRF_EXPORT const NamesOfAll& namesOfAll();

/// All values of an enumeration with their names, in the order of the help.
template <typename Enum>
const Names<Enum>& names()
{
  return std::get<Names<Enum>>(namesOfAll());
}

template <typename Enum>
std::string nameOf(Enum value)
{
  for (const auto& [name, candidate] : names<Enum>())
    if (candidate == value)
      return name;
  return "?";
}
/// @}

} // namespace pcl::mrf

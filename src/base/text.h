// SPDX-License-Identifier: BSD-3-Clause
/// Texts with numbers, for messages.
#pragma once

#include <sstream>
#include <string>

namespace pcl::mrf {

/// The parts one after the other. \param digits significant digits of the numbers
template <typename... Parts>
std::string textOf(int digits, const Parts&... parts)
{
  std::ostringstream text;
  text.precision(digits);
  (text << ... << parts);
  return text.str();
}

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// Parses sensor positions and views from the command line and from files.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <string>
#include <vector>

namespace mrf_apps {

/// \return false unless the text is three finite numbers, X,Y,Z
bool parseSensor(const std::string& text, Eigen::Vector3d& position);

/// Parses the text of a file with a position x y z per line. Empty lines and lines that start with # are skipped.
/// \param path for messages \throw FileError
std::vector<Eigen::Vector3d> parseSensors(const std::string& path, const std::string& text);

/// The same for a file with a whole number per line: the sensor, from 0, that saw each point.
std::vector<std::int32_t> parseViews(const std::string& path, const std::string& text);

} // namespace mrf_apps

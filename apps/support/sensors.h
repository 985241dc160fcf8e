// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Sensor positions and views, from the command line and from files.
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <string>
#include <vector>

namespace mrf_apps {

/// \return false unless the text is three finite numbers, X,Y,Z
bool parseSensor(const std::string& text, Eigen::Vector3d& position);

/// One position per line, x y z. Empty lines and lines that start with # are skipped. \throw FileError
std::vector<Eigen::Vector3d> readSensors(const std::string& path);

/// One whole number per line: the sensor, from 0, that saw each point. Lines as in readSensors. \throw FileError
std::vector<std::int32_t> readViews(const std::string& path);

/// The same two for the bytes of a file. \param path for messages
std::vector<Eigen::Vector3d> parseSensors(const std::string& path, const std::string& text);
std::vector<std::int32_t> parseViews(const std::string& path, const std::string& text);

} // namespace mrf_apps

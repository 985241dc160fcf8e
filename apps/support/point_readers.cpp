// SPDX-License-Identifier: BSD-3-Clause
#include "point_readers.h"

#include "text_file.h"

#include <initializer_list>

namespace mrf_apps {
namespace {

using PartNames = std::array<const char*, 3>;

std::optional<Triple> findVector(const std::vector<std::string>& names, std::initializer_list<PartNames> candidates)
{
  for (const PartNames& parts : candidates) {
    Triple found{};
    for (std::size_t part = 0; part < 3; ++part) {
      const auto isIt = [&](const std::string& name) { return equalsIgnoringCase(name, parts[part]); };
      found[part] = static_cast<std::size_t>(std::find_if(names.begin(), names.end(), isIt) - names.begin());
    }
    if (*std::max_element(found.begin(), found.end()) < names.size())
      return found;
  }
  return {};
}

} // namespace

VectorColumns::VectorColumns(const std::vector<std::string>& names)
    : position(findVector(names, {{"x", "y", "z"}, {"points:0", "points:1", "points:2"}})),
      normal(findVector(names, {{"nx", "ny", "nz"},
                                {"normal_x", "normal_y", "normal_z"},
                                {"normalx", "normaly", "normalz"},
                                {"normals:0", "normals:1", "normals:2"}})),
      color(findVector(names, {{"red", "green", "blue"},
                               {"r", "g", "b"},
                               {"rf", "gf", "bf"},
                               {"diffuse_red", "diffuse_green", "diffuse_blue"}}))
{}

bool VectorColumns::hold(std::size_t column) const
{
  for (const auto& vector : {position, normal, color})
    if (vector && std::find(vector->begin(), vector->end(), column) != vector->end())
      return true;
  return false;
}

void addColors(const std::vector<Eigen::Vector3f>& colors, bool areWhole, PointTable& table)
{
  float max = 0;
  for (const Eigen::Vector3f& color : colors)
    for (const float channel : color)
      max = std::max(max, channel);
  const double scale = max >= 256 ? 1. / 257 : max > 1 || areWhole ? 1 : 255;
  table.colors.reserve(colors.size());
  for (const Eigen::Vector3f& color : colors) {
    const Eigen::Vector3d bytes = scale * color.cast<double>();
    table.colors.push_back({toByte(bytes.x()), toByte(bytes.y()), toByte(bytes.z())});
  }
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "point_readers.h"

#include "text_file.h"

#include <cstring>
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

template <typename T>
void decodeAs(const char* from, std::size_t stride, std::size_t count, bool isReversed, double* to)
{
  for (std::size_t i = 0; i < count; ++i, from += stride) {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), from, sizeof(T));
    if (isReversed)
      std::reverse(bytes.begin(), bytes.end());
    T value;
    std::memcpy(&value, bytes.data(), sizeof(T));
    to[i] = static_cast<double>(value);
  }
}

} // namespace

VectorColumns::VectorColumns(const std::vector<std::string>& names)
    : position(findVector(names, {{"x", "y", "z"},
                                  {"easting", "northing", "elevation"},
                                  {"easting", "northing", "height"},
                                  {"easting", "northing", "altitude"},
                                  {"easting", "northing", "z"},
                                  {"east", "north", "height"},
                                  {"east", "north", "elevation"},
                                  {"e", "n", "h"},
                                  {"e", "n", "z"},
                                  {"points:0", "points:1", "points:2"},
                                  {"points_m_xyz:0", "points_m_xyz:1", "points_m_xyz:2"},
                                  {"point_x", "point_y", "point_z"},
                                  {"pos_x", "pos_y", "pos_z"},
                                  {"x coordinate", "y coordinate", "z coordinate"}})),
      normal(findVector(names, {{"nx", "ny", "nz"},
                                {"normal_x", "normal_y", "normal_z"},
                                {"normalx", "normaly", "normalz"},
                                {"normals:0", "normals:1", "normals:2"}})),
      color(findVector(names, {{"red", "green", "blue"},
                               {"r", "g", "b"},
                               {"rf", "gf", "bf"},
                               {"diffuse_red", "diffuse_green", "diffuse_blue"}}))
{}

bool VectorColumns::hasPart(const std::optional<Triple>& vector, std::size_t column)
{
  return vector && std::find(vector->begin(), vector->end(), column) != vector->end();
}

bool VectorColumns::hold(std::size_t column) const
{
  return hasPart(position, column) || hasPart(normal, column) || hasPart(color, column);
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

TableFiller::TableFiller(const std::vector<std::string>& names, std::size_t rows, PointTable& table)
    : table_(table), vectors_(names), scalars_(names.size(), nullptr)
{
  table.positions.reserve(rows);
  table.normals.reserve(vectors_.normal ? rows : 0);
  colors_.reserve(vectors_.color ? rows : 0);
  for (std::size_t column = 0; column < names.size(); ++column) {
    if (names[column].empty() || vectors_.hold(column))
      continue;
    std::vector<float>& scalar = table.scalars[names[column]];
    if (std::find(scalars_.begin(), scalars_.end(), &scalar) == scalars_.end())
      scalars_[column] = &scalar;
    scalar.reserve(rows);
  }
}

const NumberType* numberType(char kind, std::size_t size)
{
  static constexpr NumberType all[] = {{'I', 1, decodeAs<std::int8_t>},   {'I', 2, decodeAs<std::int16_t>},
                                       {'I', 4, decodeAs<std::int32_t>},  {'I', 8, decodeAs<std::int64_t>},
                                       {'U', 1, decodeAs<std::uint8_t>},  {'U', 2, decodeAs<std::uint16_t>},
                                       {'U', 4, decodeAs<std::uint32_t>}, {'U', 8, decodeAs<std::uint64_t>},
                                       {'F', 4, decodeAs<float>},         {'F', 8, decodeAs<double>}};
  for (const NumberType& type : all)
    if (type.kind == kind && type.size == size)
      return &type;
  return nullptr;
}

} // namespace mrf_apps

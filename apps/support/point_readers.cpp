// SPDX-License-Identifier: BSD-3-Clause
#include "point_readers.h"

#include "text_file.h"

#include <cstring>
#include <initializer_list>
#include <map>
#include <set>

namespace mrf_apps {
namespace {

using PartNames = std::array<const char*, 3>;

/// A name in lower case with "_" between its words: "Pos.X", "pos x" and "posX" all become "pos_x".
std::string wordsOf(const std::string& name)
{
  std::string words;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool begins = i > 0 && lowerCase(name[i]) != name[i] && name[i - 1] >= 'a' && name[i - 1] <= 'z';
    words += begins ? "_" : "";
    words += std::string_view("_. -").find(name[i]) == std::string_view::npos ? lowerCase(name[i]) : '_';
  }
  return words;
}

/// The position of an axis in a name such as "world_x_m"; npos unless all other words are known as words of places or
/// frames or, behind the axis, of units. An unknown word may make it a velocity or the position of a sensor.
std::size_t findAxis(const std::string& words, std::string_view axis)
{
  static const std::set<std::string_view> frames = {
      "",         "p",     "pos",    "position", "point", "points", "coord", "coords", "coordinate", "coordinates",
      "location", "local", "global", "world",    "map",   "utm",    "xyz"};
  static const std::set<std::string_view> units = {"m",  "mm",     "cm",   "dm",    "km",    "us",     "ft",
                                                   "in", "survey", "feet", "meter", "metre", "meters", "metres"};
  std::size_t place = std::string::npos;
  for (std::size_t begin = 0, end = 0; begin <= words.size(); begin = end + 1) {
    end = std::min(words.find('_', begin), words.size());
    const std::string_view word(&words[begin], end - begin);
    if (word == axis)
      place = begin;
    else if (frames.count(word) == 0 && (place == std::string::npos || units.count(word) == 0))
      return std::string::npos;
  }
  return place;
}

/// Columns by their names.
class NamedColumns {
public:
  explicit NamedColumns(const std::vector<std::string>& names)
  {
    for (std::size_t column = 0; column < names.size(); ++column) {
      names_.push_back(wordsOf(names[column]));
      columns_.emplace(names_.back(), column);
    }
  }

  std::optional<Triple> find(std::initializer_list<PartNames> candidates, const std::string& before = {},
                             const std::string& behind = {}) const
  {
    for (const PartNames& parts : candidates) {
      Triple found{};
      const auto isThere = [&](std::size_t part) {
        const auto column = columns_.find(before + parts[part] + behind);
        found[part] = column == columns_.end() ? 0 : column->second;
        return column != columns_.end();
      };
      if (isThere(0) && isThere(1) && isThere(2))
        return found;
    }
    return {};
  }

  /// Prefers names that are the axes alone; else the first columns with the same words around each axis.
  std::optional<Triple> findAxes(std::initializer_list<PartNames> candidates) const
  {
    std::optional<Triple> found = find(candidates);
    for (const PartNames& axes : candidates)
      for (std::size_t column = 0; !found && column < names_.size(); ++column)
        if (const std::size_t at = findAxis(names_[column], axes[0]); at != std::string::npos)
          found = find({axes}, names_[column].substr(0, at), names_[column].substr(at + std::strlen(axes[0])));
    return found;
  }

private:
  std::vector<std::string> names_;
  std::map<std::string, std::size_t> columns_; ///< the first of each name
};

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
{
  const NamedColumns columns(names);
  position = columns.findAxes({{"x", "y", "z"},
                               {"px", "py", "pz"},
                               {"points:0", "points:1", "points:2"},
                               {"points_m_xyz:0", "points_m_xyz:1", "points_m_xyz:2"}});
  for (const std::array<const char*, 2>& plan : {std::array<const char*, 2>{"easting", "northing"},
                                                 {"east", "north"},
                                                 {"e", "n"},
                                                 {"x", "y"},
                                                 {"rechtswert", "hochwert"}})
    for (const char* up :
         {"elevation", "elev", "height", "orthometric_height", "altitude", "up", "rl", "h", "hoehe", "z"})
      if (!position)
        position = columns.findAxes({{plan[0], plan[1], up}});
  normal = columns.find({{"nx", "ny", "nz"},
                         {"n_x", "n_y", "n_z"},
                         {"normal_x", "normal_y", "normal_z"},
                         {"normalx", "normaly", "normalz"},
                         {"normals:0", "normals:1", "normals:2"}});
  color = columns.find({{"red", "green", "blue"},
                        {"r", "g", "b"},
                        {"rf", "gf", "bf"},
                        {"diffuse_red", "diffuse_green", "diffuse_blue"}});
}

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
  constexpr float one = 1.01f; // rounding exceeds 1
  const double scale = max >= 256 ? 1. / 257 : max > one || areWhole ? 1 : 255;
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
    const bool isIntensity = equalsIgnoringCase(names[column], "intensity") ||
                             equalsIgnoringCase(names[column], "scalar_intensity"); // as CloudCompare writes it
    const auto [scalar, isFirst] = table.scalars.try_emplace(isIntensity ? "intensity" : names[column]);
    if (isFirst)
      scalars_[column] = &scalar->second;
    scalar->second.reserve(rows);
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

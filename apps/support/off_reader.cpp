// SPDX-License-Identifier: BSD-3-Clause
// OFF is read here, because neither PCL nor VTK reads it.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <string>

namespace mrf_apps {

PointTable parseOff(const std::string& path, const std::string& text, Polygons* faces)
{
  Lines lines(text, path);
  std::vector<std::string_view> words;
  std::vector<double> values;
  const auto nextLine = [&] {
    if (!lines.next(words, '#'))
      throw FileError(path, "is truncated");
  };
  // Takes the numbers from a word on. Behind the indices of a face there may be a color, by whatever name.
  const auto takeNumbers = [&](std::size_t first) {
    values.clear();
    for (double value = 0; first < words.size() && toNumber(words[first], value); ++first)
      values.push_back(value);
  };
  const auto nextNumbers = [&](std::size_t min) {
    nextLine();
    takeNumbers(0);
    if (values.size() < min)
      lines.fail("has fewer than " + std::to_string(min) + " numbers");
  };

  nextLine();
  const std::string_view kind = words[0];
  const bool hasColors = kind.front() == 'C', hasNormals = kind.find('N') != std::string_view::npos;
  if (kind != std::string(hasColors ? "C" : "") + (hasNormals ? "N" : "") + "OFF")
    throw FileError(path, "is not an OFF file in text");
  if (words.size() == 1)
    nextNumbers(2);
  else
    takeNumbers(1);
  if (values.size() < 2 || !isCount(values[0]) || !isCount(values[1]))
    throw FileError(path, "is not an OFF file: its numbers of vertices and faces are missing");
  const double vertexCount = values[0], faceCount = values[1];

  std::vector<std::string> columns = {"x", "y", "z"};
  if (hasNormals)
    columns.insert(columns.end(), {"nx", "ny", "nz"});
  if (hasColors)
    columns.insert(columns.end(), {"red", "green", "blue"});
  PointTable table;
  TableFiller filler(columns, 0, table); // what the file says may not be there
  for (double v = 0; v < vertexCount; ++v) {
    nextNumbers(columns.size());
    filler.add(1, [&values](std::size_t, std::size_t column) { return values[column]; });
  }
  filler.finish(false);
  if (faces == nullptr)
    return table;
  for (double f = 0; f < faceCount; ++f) {
    nextNumbers(1);
    if (!isCount(values[0]) || static_cast<double>(values.size()) < values[0] + 1)
      throw FileError(path, "is truncated or malformed: a face has fewer corners than it says");
    for (std::size_t i = 1; static_cast<double>(i) <= values[0]; ++i)
      faces->corners.push_back(isCount(values[i]) ? static_cast<std::int64_t>(values[i]) : -1);
    faces->close();
  }
  return table;
}

} // namespace mrf_apps

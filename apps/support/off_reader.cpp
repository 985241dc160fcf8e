// SPDX-License-Identifier: BSD-3-Clause
// OFF is read here, because neither PCL nor VTK reads it.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <string>

namespace mrf_apps {
namespace {

/// The lines of an OFF file without comments and empty ones, as numbers.
class OffLines {
public:
  OffLines(const std::string& path, std::string_view text) : path_(path), lines_(text, path) {}

  /// The next line's words. \throw FileError at the end of the file
  const std::vector<std::string_view>& words()
  {
    if (!lines_.next(words_, '#'))
      throw FileError(path_, "is truncated");
    return words_;
  }

  /// The next line's numbers, at least so many.
  const std::vector<double>& numbers(std::size_t min)
  {
    words();
    numbers_.clear();
    // Behind the indices of a face there may be a color, by whatever name.
    for (double value = 0; numbers_.size() < words_.size() && toNumber(words_[numbers_.size()], value);)
      numbers_.push_back(value);
    if (numbers_.size() < min)
      lines_.fail("has fewer than " + std::to_string(min) + " numbers");
    return numbers_;
  }

private:
  const std::string& path_;
  Lines lines_;
  std::vector<std::string_view> words_;
  std::vector<double> numbers_;
};

} // namespace

PointTable parseOff(const std::string& path, const std::string& text, Polygons* faces)
{
  OffLines lines(path, text);
  std::vector<std::string_view> first = lines.words();
  const bool hasColors = first[0].front() == 'C', hasNormals = first[0].find('N') != std::string_view::npos;
  if (first[0] != std::string(hasColors ? "C" : "") + (hasNormals ? "N" : "") + "OFF")
    throw FileError(path, "is not an OFF file in text");
  std::vector<double> counts;
  if (first.size() == 1)
    counts = lines.numbers(2);
  else {
    double value = 0;
    for (std::size_t i = 1; i < first.size() && toNumber(first[i], value); ++i)
      counts.push_back(value);
  }
  if (counts.size() < 2 || !isCount(counts[0]) || !isCount(counts[1]))
    throw FileError(path, "is not an OFF file: its numbers of vertices and faces are missing");

  std::vector<std::string> columns = {"x", "y", "z"};
  if (hasNormals)
    columns.insert(columns.end(), {"nx", "ny", "nz"});
  if (hasColors)
    columns.insert(columns.end(), {"red", "green", "blue"});
  PointTable table;
  TableFiller filler(columns, 0, table); // what the file says may not be there
  for (double v = 0; v < counts[0]; ++v) {
    const std::vector<double>& values = lines.numbers(columns.size());
    filler.add(1, [&values](std::size_t, std::size_t column) { return values[column]; });
  }
  filler.finish(false);
  if (faces == nullptr)
    return table;
  for (double f = 0; f < counts[1]; ++f) {
    const std::vector<double>& values = lines.numbers(1);
    if (!isCount(values[0]) || static_cast<double>(values.size()) < values[0] + 1)
      throw FileError(path, "is truncated or malformed: a face has fewer corners than it says");
    for (std::size_t i = 1; static_cast<double>(i) <= values[0]; ++i)
      faces->corners.push_back(isCount(values[i]) ? static_cast<std::int64_t>(values[i]) : -1);
    faces->close();
  }
  return table;
}

} // namespace mrf_apps

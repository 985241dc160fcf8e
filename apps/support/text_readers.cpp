// SPDX-License-Identifier: BSD-3-Clause
// Reads rows of numbers, PTX and OBJ. The first two have no other reader; PCL's of OBJ pairs vertices and normals by
// their order in the file.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>

namespace mrf_apps {
namespace {

bool isComment(std::string_view line)
{
  const std::size_t begin = line.find_first_not_of(" \t,;");
  return begin == std::string_view::npos || line[begin] == '#' || line.substr(begin, 2) == "//";
}

/// The units in a line of names such as "X [m]" or "Height(ft)": short texts in brackets without a digit.
std::vector<std::string_view> unitsIn(std::string_view line)
{
  constexpr std::size_t longest = 14;
  std::vector<std::string_view> units;
  for (std::size_t open = 0; (open = line.find_first_of("[(", open)) != line.npos; ++open) {
    const std::string_view behind = line.substr(open + 1, longest + 1);
    const std::size_t length = behind.find_first_of("])0123456789");
    if (length == line.npos || (behind[length] >= '0' && behind[length] <= '9'))
      continue;
    units.push_back(behind.substr(0, length));
    open += length + 1;
  }
  return units;
}

std::string withoutUnits(std::string_view line)
{
  std::string names;
  const char* rest = line.data();
  for (const std::string_view unit : unitsIn(line)) {
    names.append(rest, unit.data() - 1);
    rest = unit.data() + unit.size() + 1;
  }
  return names.append(rest, line.data() + line.size());
}

/// The units of length in brackets behind the names of the coordinates, each once.
std::set<std::string> lengthUnits(std::string_view line, const std::vector<std::string>& names)
{
  constexpr std::string_view splitters = " \t,;\"#/";
  constexpr std::array<std::string_view, 13> lengths = {"m",    "mm",        "cm", "dm",   "km",     "ft",    "us ft",
                                                        "usft", "survey ft", "in", "feet", "meters", "metres"};
  const Triple position = *VectorColumns(names).position;
  std::set<std::string> units;
  for (const std::string_view inBrackets : unitsIn(line)) {
    const std::size_t begin = std::min(inBrackets.find_first_not_of(' '), inBrackets.size());
    const std::string_view unit = inBrackets.substr(begin, inBrackets.find_last_not_of(' ') + 1 - begin);
    if (std::none_of(lengths.begin(), lengths.end(), [&](auto length) { return equalsIgnoringCase(unit, length); }))
      continue;
    std::string_view before = line.substr(0, static_cast<std::size_t>(inBrackets.data() - 1 - line.data()));
    before = before.substr(0, before.find_last_not_of(" \t\"") + 1);
    for (const std::size_t column : position) {
      const std::size_t rest = before.size() - std::min(names[column].size(), before.size());
      if (before.substr(rest) == names[column] && (rest == 0 || splitters.find(before[rest - 1]) != splitters.npos))
        units.emplace(unit);
    }
  }
  return units;
}

/// True if a cell marks a missing number, as R, databases, Windows and spreadsheets do.
bool isMissing(std::string_view cell)
{
  for (const std::string_view word : {"", "NA", "N/A", "#N/A", "null", "none", "-"})
    if (equalsIgnoringCase(cell, word))
      return true;
  return cell.find(".#") != std::string_view::npos || (cell.front() == '#' && cell.back() == '!');
}

/// The cells of a column that hold no number.
struct Gaps {
  std::size_t count = 0, missingLine = 0, textLine = 0; ///< all; line of the first missing number, of the first text
  std::string_view text;                                ///< the first text
};

/// Rows of numbers with the same number of columns; NaN in the gaps.
struct Rows {
  std::size_t columns = 0;
  std::vector<double> values;
  std::vector<std::string> names; ///< of the columns; a column with an empty name is skipped
  std::vector<Gaps> gaps;         ///< of the columns
  bool areCounted = false;        ///< a line holds the number of rows
  bool arePts = false;            ///< the format is pts: an intensity is before the colors
  bool areXyzrgb = false;         ///< the format is xyzrgb: colors, maybe up to 1, are behind the coordinates
  std::size_t missingLine = 0;    ///< the first that lacks a coordinate, from 1; 0: none

  std::size_t size() const { return columns == 0 ? 0 : values.size() / columns; }
  double at(std::size_t row, std::size_t column) const { return values[row * columns + column]; }
};

/// Splits a line at its tabs, without tabs at semicolons, without these at commas; a cell may be empty or have several
/// words. A line with none of them is split at blanks. Separators within quotes do not count, and quotes are removed.
void splitCells(std::string_view line, std::vector<std::string_view>& cells)
{
  const auto endOfCell = [line, areClosed = std::count(line.begin(), line.end(), '"') % 2 == 0](std::size_t at,
                                                                                                char by) {
    for (bool isQuoted = false; at < line.size() && (line[at] != by || isQuoted); ++at)
      isQuoted = isQuoted != (areClosed && line[at] == '"');
    return at;
  };
  const auto isIn = [&](char separator) { return endOfCell(0, separator) < line.size(); };
  const char separator = isIn('\t') ? '\t' : isIn(';') ? ';' : ',';
  split(line, cells);
  if (isIn(separator)) {
    cells.clear();
    for (std::size_t begin = 0, end = 0; begin <= line.size(); begin = end + 1) {
      end = endOfCell(begin, separator);
      cells.push_back(line.substr(begin, end - begin));
    }
  }
  for (std::string_view& cell : cells) {
    cell.remove_prefix(std::min(cell.find_first_not_of(" \""), cell.size()));
    cell = cell.substr(0, cell.find_last_not_of(" \"") + 1);
  }
}

/// True for ",0,1,2": what a data frame without names of its own is written with.
bool isHeaderOfNumbers(std::string_view line)
{
  std::vector<std::string_view> cells;
  splitCells(line, cells);
  for (std::size_t n = 1; n < cells.size(); ++n)
    if (cells[n] != std::to_string(n - 1))
      return false;
  return cells.size() >= 4 && cells.front().empty();
}

/// Reads rows line by line.
class RowParser {
public:
  RowParser(const std::string& path, std::string_view text)
      : path_(path), lines_(text.substr(text.substr(0, 3) == "\xef\xbb\xbf" ? 3 : 0), path)
  {}

  Rows parse()
  {
    for (std::string_view line; lines_.next(line);)
      if (!isComment(line))
        take(line);
      else
        takeNames(line);
    if (announced_ > static_cast<double>(rows_.size()))
      throw FileError(path_, "is truncated: it announces " + std::to_string(static_cast<long long>(announced_)) +
                                 " points and holds " + std::to_string(rows_.size()));
    return std::move(rows_);
  }

private:
  bool takeNames(std::string_view line)
  {
    // COLMAP names the track of a point so: from this column on, each row has a list of any length.
    const std::size_t list = line.find("[] as (");
    std::vector<std::string> names = rows_.columns > 0 ? std::vector<std::string>() : columnNames(line.substr(0, list));
    const bool areThere = !names.empty();
    if (areThere) {
      if (const std::vector<std::string> before(names.begin(), names.end() - 1);
          list != line.npos && VectorColumns(before).position) {
        names = before;
        beforeList_ = names.size();
      }
      if (const std::set<std::string> units = lengthUnits(line, names); units.size() > 1)
        lines_.fail("has coordinates in " + *units.begin() + " and in " + *units.rbegin() + ": give all in one unit");
      rows_.names = std::move(names);
      isHeader_ = !isComment(line);
    }
    return areThere;
  }

  /// A count is before all rows or, in PTS, before the rows of each scan. \return false if the line is no count
  bool takeCount()
  {
    if ((rows_.columns > 0 && !rows_.areCounted) || values_.size() != 1 || !isCount(values_[0]))
      return false;
    announced_ += values_[0];
    return rows_.areCounted = true;
  }

  void take(std::string_view line)
  {
    if (rows_.columns == 0 && isHeaderOfNumbers(line))
      return;
    (line.find('"') == std::string_view::npos ? splitRow : splitCells)(line, cells_);
    const bool areNumbers = toNumbers(cells_, values_);
    if (areNumbers && haveDecimalCommas(cells_)) // each would split a number into two
      lines_.fail("has commas within numbers, it seems; write 0.5 for 0,5, or part all columns by commas");
    if (areNumbers ? takeCount() : takeNames(line))
      return;
    if (beforeList_ > 0 && cells_.size() > beforeList_) {
      cells_.resize(beforeList_);
      values_.resize(std::min(values_.size(), beforeList_));
    }
    const std::size_t expected = rows_.columns > 0 ? rows_.columns : rows_.names.size();
    const auto separators = std::count_if(line.begin(), line.end(), [](char c) { return c == ',' || c == ';'; });
    const bool haveGaps = !areNumbers || static_cast<std::size_t>(separators) >= cells_.size() ||
                          (expected > 0 && cells_.size() != expected);
    if (haveGaps) {
      splitCells(line, cells_);
      while (cells_.size() > expected && cells_.back().empty())
        cells_.pop_back();
    }
    if (rows_.columns == 0)
      start(line.find_first_of(",;\t") != std::string_view::npos);
    if (cells_.size() != rows_.columns)
      lines_.fail("has " + std::to_string(cells_.size()) + " columns, those before have " +
                  std::to_string(rows_.columns));
    if (haveGaps)
      takeGaps();
    rows_.values.insert(rows_.values.end(), values_.begin(), values_.end());
  }

  /// Starts with the first row. \param isParted its cells are separated by more than blanks
  void start(bool isParted)
  {
    double number = 0;
    const auto numbers = std::count_if(
        cells_.begin(), cells_.end(), [&](std::string_view cell) { return toNumber(cell, number) || isMissing(cell); });
    if (cells_.size() == 2 && equalsIgnoringCase(cells_[0], "ncols"))
      lines_.fail("begins a grid of heights, which is no list of points; convert it, as by gdal_translate -of XYZ");
    if (cells_.size() < 3 && numbers > 0)
      lines_.fail("has fewer than the three columns x y z");
    if (rows_.names.size() != cells_.size() && numbers < 3)
      lines_.fail("is not a row of numbers, nor names columns x, y and z, which are lengths: name them so, or delete "
                  "the line where they come first");
    // Names that do not match are ignored, and x y z taken to be first; so a header must match or begin with x y z. A
    // column that numbers the points needs no name. A comment need not match: it may be a sentence.
    const std::size_t names = rows_.names.size();
    if (isHeader_ && names != cells_.size() && names + 1 != cells_.size() &&
        (isParted || VectorColumns(rows_.names).position != Triple{0, 1, 2}))
      lines_.fail("has " + std::to_string(cells_.size()) + " columns, the header names " + std::to_string(names) +
                  "; name each of them, and write 0.5 for 0,5");
    rows_.columns = cells_.size();
    rows_.gaps.resize(rows_.columns);
  }

  void takeGaps()
  {
    values_.resize(cells_.size());
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (toNumber(cells_[i], values_[i]))
        continue;
      values_[i] = std::nan(""); // toNumber may have stored a number that the text begins with
      Gaps& gaps = rows_.gaps[i];
      ++gaps.count;
      std::size_t& first = isMissing(cells_[i]) ? gaps.missingLine : gaps.textLine;
      if (first == 0 && &first == &gaps.textLine)
        gaps.text = cells_[i];
      first = first == 0 ? lines_.number() : first;
    }
  }

  const std::string& path_;
  Lines lines_;
  Rows rows_;
  bool isHeader_ = false;      ///< the names are in a line that is no comment
  std::size_t beforeList_ = 0; ///< columns before the list in each row; 0: there is no list
  double announced_ = 0;
  std::vector<std::string_view> cells_;
  std::vector<double> values_;
};

/// The columns that are neither text nor empty. Refuses text in a coordinate, a normal or a color, coordinates without
/// any number, and, if columns have no names, text in a column with numbers.
std::vector<std::size_t> columnsOfNumbers(const std::string& path, Rows& rows, std::vector<std::string>& notes)
{
  constexpr std::size_t longest = 40; // characters of a text in a message
  const bool areNamed = rows.names.size() == rows.columns;
  const VectorColumns vectors(areNamed ? rows.names : std::vector<std::string>());
  std::vector<std::size_t> result;
  for (std::size_t c = 0; c < rows.columns; ++c) {
    const Gaps& gaps = rows.gaps[c];
    const bool hasNumbers = gaps.count < rows.size();
    const bool isCoordinate = areNamed ? VectorColumns::hasPart(vectors.position, c) : hasNumbers && result.size() < 3;
    const std::string column =
        "column " + std::to_string(c + 1) + (areNamed && !rows.names[c].empty() ? " '" + rows.names[c] + "'" : "");
    const std::string text = "holds '" + std::string(gaps.text.substr(0, longest)) + "', which is no number";
    if (gaps.textLine > 0 && (areNamed ? vectors.hold(c) : hasNumbers))
      throw FileError(path, gaps.textLine, column + " " + text + " such as -0.5: correct it, or delete the line");
    if (isCoordinate && !hasNumbers)
      throw FileError(path, column + " holds no number: it is a coordinate of the points");
    if (isCoordinate && gaps.missingLine > 0)
      rows.missingLine = rows.missingLine == 0 ? gaps.missingLine : std::min(rows.missingLine, gaps.missingLine);
    if (gaps.textLine > 0)
      notes.push_back(column + " is skipped: line " + std::to_string(gaps.textLine) + " " + text);
    else if (hasNumbers)
      result.push_back(c);
  }
  if (rows.size() > 0 && result.size() < 3)
    throw FileError(path, "has fewer than three columns with numbers, as x y z are");
  return result;
}

void keepColumns(const std::vector<std::size_t>& kept, Rows& rows)
{
  if (kept.size() == rows.columns)
    return;
  std::size_t end = 0;
  for (std::size_t row = 0; row < rows.size(); ++row)
    for (const std::size_t column : kept)
      rows.values[end++] = rows.at(row, column);
  if (rows.names.size() == rows.columns) {
    std::transform(kept.begin(), kept.end(), rows.names.begin(),
                   [&](std::size_t column) { return rows.names[column]; });
    rows.names.resize(kept.size());
  }
  rows.values.resize(end);
  rows.columns = kept.size();
}

/// True if the first column numbers the rows, from any number on, in any step and with a few left out, or has their
/// times since 1970 in seconds or parts of them. With fewer than `min` rows it may be a coordinate.
bool areNumbered(const Rows& rows)
{
  constexpr std::size_t min = 10, few = 10; // rows; one step in so many may be a longer one
  constexpr double earliest = 1e9;          // seconds; no coordinate is as large
  if (rows.columns < 4 || rows.size() < min)
    return false;
  const double step = rows.at(1, 0) - rows.at(0, 0);
  bool areCounts = step > 0, areTimes = rows.at(0, 0) >= earliest;
  std::size_t leftOut = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double difference = i > 0 ? rows.at(i, 0) - rows.at(i - 1, 0) : step;
    areCounts = areCounts && isCount(rows.at(i, 0)) && difference > 0;
    leftOut += difference != step ? 1 : 0;
    areTimes = areTimes && difference >= 0;
  }
  areCounts = areCounts && leftOut * few <= rows.size();
  return areCounts || areTimes;
}

enum class Content { unknown, normals, colors };

/// What three columns hold, judged by their values; unknown if all are zero.
Content contentOf(const Rows& rows, std::size_t column)
{
  std::size_t zeros = 0, units = 0, bytes = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Eigen::Map<const Eigen::Vector3d> v(&rows.values[i * rows.columns + column]);
    const double length = v.norm();
    zeros += length == 0;
    units += std::abs(length - 1) < .1 || !(length > 0);
    bytes += v.array().round().matrix() == v && v.minCoeff() >= 0 && v.maxCoeff() <= 255;
  }
  return zeros == rows.size()            ? Content::unknown
         : 10 * units >= 9 * rows.size() ? Content::normals
         : bytes == rows.size()          ? Content::colors
                                         : Content::unknown;
}

/// Names columns that no header names.
void guessNames(Rows& rows, std::vector<std::string>& notes)
{
  std::vector<std::string>& names = rows.names;
  names = std::vector<std::string>(areNumbered(rows) ? 1 : 0);
  const auto add = [&names](std::initializer_list<const char*> more) {
    names.insert(names.end(), more.begin(), more.end());
  };
  add({"x", "y", "z"});
  const auto left = [&] { return rows.columns - names.size(); };
  const auto next = [&](std::size_t skipped) { return contentOf(rows, names.size() + skipped); };
  // PTS has the intensity before the colors; other files may have a scalar behind them, which may look like a color.
  if (left() == 1 || (left() % 3 == 1 && (rows.arePts || (next(1) != Content::unknown &&
                                                          (next(0) == Content::unknown ||
                                                           (rows.areCounted && next(0) == Content::colors))))))
    add({"intensity"});
  bool hasNormals = false, hasColors = false;
  while (left() >= 3) {
    const Content content = rows.areXyzrgb && !hasColors ? Content::colors : next(0);
    const std::string columns =
        "columns " + std::to_string(names.size() + 1) + " to " + std::to_string(names.size() + 3);
    if (content == Content::normals && !hasNormals) {
      hasNormals = true;
      add({"nx", "ny", "nz"});
    } else if (content == Content::colors && !hasColors) {
      hasColors = true;
      add({"red", "green", "blue"});
      if (!rows.areXyzrgb)
        notes.push_back(columns + " are whole numbers up to 255: taken for colors");
    } else {
      if (!hasNormals && !hasColors)
        notes.push_back(columns + " are neither unit normals nor colors: kept as scalars");
      break;
    }
  }
  while (left() > 0)
    names.push_back("column" + std::to_string(names.size() + 1));
}

PointTable toTable(Rows rows, std::vector<std::string> notes = {})
{
  PointTable table;
  table.notes = std::move(notes);
  if (rows.size() == 0)
    return table;
  if (rows.names.size() + 1 == rows.columns && areNumbered(rows)) // data frames are written so
    rows.names.insert(rows.names.begin(), "");
  if (rows.names.size() != rows.columns) {
    if (!rows.names.empty())
      table.notes.push_back(std::to_string(rows.names.size()) + " columns have names, but the rows have " +
                            std::to_string(rows.columns) + ": the names are ignored");
    guessNames(rows, table.notes);
  }
  if (rows.names.front().empty())
    table.notes.emplace_back("column 1 numbers the points, or has their times: skipped");
  TableFiller filler(rows.names, rows.size(), table);
  filler.add(rows.size(), [&](std::size_t row, std::size_t column) { return rows.at(row, column); });
  filler.finish(false);
  return table;
}

/// The vertex and the normal of a corner of a face, "v", "v/t", "v//n" or "v/t/n", from 0; the normal is −1 if there is
/// none. Negative indices count from the end. \return false if it is no corner
bool parseCorner(std::string_view word, std::size_t vertices, std::size_t normals, std::int64_t& vertex,
                 std::int64_t& normal)
{
  std::array<std::int64_t, 3> indices{};
  for (std::size_t part = 0; part < 3; ++part) {
    const std::size_t slash = word.find('/');
    const std::string_view digits = word.substr(0, slash);
    if (!digits.empty()) {
      const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), indices[part]);
      if (result.ec != std::errc() || result.ptr != digits.data() + digits.size())
        return false;
    }
    if (slash == std::string_view::npos)
      break;
    word.remove_prefix(slash + 1);
  }
  const auto fromZero = [](std::int64_t index, std::size_t count) {
    return index < 0 ? static_cast<std::int64_t>(count) + index : index - 1;
  };
  vertex = fromZero(indices[0], vertices);
  normal = fromZero(indices[2], normals);
  return vertex >= 0 && normal >= -1;
}

/// \param normals of the file \param corners numbers of vertices, and of their normals
void addObjNormals(const std::vector<Eigen::Vector3f>& normals, const std::vector<std::int64_t>& corners,
                   const std::vector<std::int64_t>& cornerNormals, PointTable& table)
{
  std::vector<Eigen::Vector3f> sums(table.size(), Eigen::Vector3f::Zero());
  bool referred = false;
  for (std::size_t c = 0; c < corners.size(); ++c)
    if (cornerNormals[c] >= 0) {
      sums[corners[c]] += normals[cornerNormals[c]];
      referred = true;
    }
  if (referred)
    for (const Eigen::Vector3f& sum : sums)
      table.normals.push_back(sum.normalized());
  else if (normals.size() == table.size()) // a cloud without faces: in the order of its vertices
    table.normals = normals;
  else if (!normals.empty())
    table.notes.emplace_back("the normals belong to no vertex: ignored");
}

} // namespace

std::vector<std::string> columnNames(std::string_view text)
{
  constexpr std::size_t longest = 1 << 16; // characters; a longer line is no header, and not worth a copy
  const std::string bare = text.size() <= longest ? withoutUnits(text) : "";
  std::string_view line = bare;
  if (isComment(line))
    line.remove_prefix(std::min(line.find_first_not_of("#/ \t"), line.size()));
  line = line.substr(0, line.find_last_not_of(" \t,;") + 1);
  std::vector<std::string_view> words;
  for (const auto splitNames : {splitCells, splitRow}) { // a name may have several words, or one
    splitNames(line, words);
    std::vector<std::string> names(words.begin(), words.end());
    if (VectorColumns(names).position)
      return names;
  }
  return {};
}

PointTable parseXyz(const std::string& path, const std::string& text, const std::string& format)
{
  Rows rows = RowParser(path, text).parse();
  rows.arePts = format == "pts";
  rows.areXyzrgb = format == "xyzrgb";
  std::vector<std::string> notes;
  keepColumns(columnsOfNumbers(path, rows, notes), rows);
  const std::size_t missing = rows.missingLine;
  PointTable table = toTable(std::move(rows), std::move(notes));
  const auto count = std::count_if(table.positions.begin(), table.positions.end(),
                                   [](const Eigen::Vector3d& position) { return position.hasNaN(); });
  if (missing > 0)
    table.warnings.push_back(std::to_string(count) + (count == 1 ? " point has" : " points have") +
                             " no number as a coordinate, in line " + std::to_string(missing) +
                             (count == 1 ? "" : " first") + ": left out");
  return table;
}

PointTable parsePtx(const std::string& path, const std::string& text)
{
  // Numbers per line: columns, rows, scanner, its three axes, and the transformation of row vectors.
  constexpr std::array<std::size_t, 10> header = {1, 1, 3, 3, 3, 3, 4, 4, 4, 4};
  Rows rows;
  std::vector<Eigen::Vector3d> sensors;
  std::vector<std::int32_t> views;
  bool areKnown = true;
  std::vector<std::string_view> words;
  std::vector<double> values;
  Lines lines(std::string_view(text).substr(0, text.find_last_not_of(" \t\r\n") + 1), path);
  const auto next = [&] {
    if (!lines.next(words))
      throw FileError(path, "is truncated: the last scan has fewer lines than its header says");
    if (!toNumbers(words, values))
      lines.fail("is not a row of numbers");
  };
  while (!lines.rest().empty()) {
    std::vector<double> numbers;
    for (const std::size_t size : header) {
      next();
      if (values.size() != size || !std::all_of(values.begin(), values.end(), [size](double value) {
            return size == 1 ? isCount(value) : std::isfinite(value);
          }))
        lines.fail("is not what the header of a scan has here: " +
                   (size == 1 ? "a count" : std::to_string(size) + " numbers"));
      numbers.insert(numbers.end(), values.begin(), values.end());
    }
    const Eigen::Map<const Eigen::Vector3d> scanner(&numbers[2]);
    const Eigen::Map<const Eigen::Matrix4d> transformation(&numbers[14]); // by columns, so it is transposed
    sensors.push_back(scanner.isZero(0) ? Eigen::Vector3d(transformation.col(3).head<3>()) : scanner);
    if (sensors.back().isZero(0) && std::min(numbers[0], numbers[1]) < 2) // as in PCD, the default that nobody set
      areKnown = false;
    for (double cell = 0; cell < numbers[0] * numbers[1]; ++cell) {
      next();
      if (rows.columns == 0)
        rows.columns = values.size();
      if ((values.size() != 4 && values.size() != 7) || values.size() != rows.columns)
        lines.fail("is not a cell x y z intensity, or all of them x y z intensity r g b");
      const Eigen::Vector3d measured = Eigen::Map<const Eigen::Vector3d>(values.data());
      if (measured.isZero(0))
        continue;
      const Eigen::Vector3d position = (transformation * measured.homogeneous()).head<3>();
      rows.values.insert(rows.values.end(), position.begin(), position.end());
      rows.values.insert(rows.values.end(), values.begin() + 3, values.end());
      views.push_back(static_cast<std::int32_t>(sensors.size() - 1));
    }
  }
  rows.names = {"x", "y", "z", "intensity", "red", "green", "blue"};
  rows.names.resize(rows.columns);
  PointTable table = toTable(std::move(rows));
  if (areKnown && sensors.size() == 1)
    table.sensorOrigin = sensors.front();
  else if (areKnown) {
    table.sensors = std::move(sensors);
    table.views = std::move(views);
  }
  return table;
}

PointTable parseObj(const std::string& path, const std::string& text, Polygons* faces)
{
  PointTable table;
  std::vector<Eigen::Vector3f> normals, colors;
  Polygons polygons;
  std::vector<std::int64_t> cornerNormals;
  std::vector<std::string_view> words;
  std::vector<double> values;
  std::string_view line;
  for (Lines lines(text, path); lines.next(line);) {
    const std::string_view key = line.substr(0, line.find_first_of(" \t"));
    if (key != "v" && key != "vn" && key != "f")
      continue;
    const auto require = [&](bool holds, const char* cause) {
      if (!holds)
        lines.fail(cause);
    };
    split(line.substr(key.size()), words);
    if (key == "f") {
      for (const std::string_view word : words)
        require(parseCorner(word, table.size(), normals.size(), polygons.corners.emplace_back(),
                            cornerNormals.emplace_back()),
                "is not a face");
      polygons.close();
      continue;
    }
    require(toNumbers(words, values), "is not a row of numbers");
    if (key == "vn") {
      require(values.size() == 3, "a normal needs three coordinates");
      normals.push_back(Eigen::Vector3d::Map(values.data()).cast<float>());
      continue;
    }
    require(values.size() >= 3, "a vertex needs three coordinates");
    table.positions.push_back(Eigen::Vector3d::Map(values.data()));
    if (values.size() >= 6)
      colors.push_back(Eigen::Vector3d::Map(&values[3]).cast<float>());
  }
  const auto areIn = [](const std::vector<std::int64_t>& indices, std::size_t count) {
    return std::all_of(indices.begin(), indices.end(),
                       [count](std::int64_t index) { return index < static_cast<std::int64_t>(count); });
  };
  if (!areIn(polygons.corners, table.size()) || !areIn(cornerNormals, normals.size()))
    throw FileError(path, "is truncated or malformed: a face refers to a vertex or normal that is not there");
  if (table.size() == 0)
    throw FileError(path, "is not an OBJ file, or has no vertices");
  if (colors.size() == table.size())
    addColors(colors, false, table);
  addObjNormals(normals, polygons.corners, cornerNormals, table);
  if (faces != nullptr)
    *faces = std::move(polygons);
  return table;
}

} // namespace mrf_apps

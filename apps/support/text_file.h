// SPDX-License-Identifier: BSD-3-Clause
/// Reads whole files as text, and numbers from text, fast and without a locale.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mrf_apps {

/// \return the extension of a path in lower case without the dot; empty if it has none
std::string extension(const std::string& path);

/// The same without .gz: ply for scan.ply.gz.
std::string unpackedExtension(const std::string& path);

/// The end of a message about a file that cannot be read: the program that converts it; empty if unknown.
/// \param type what the file is, as an extension
std::string conversionHint(const std::string& path, const std::string& type);
inline std::string conversionHint(const std::string& path)
{
  return conversionHint(path, unpackedExtension(path));
}

/// Reads a file or a pipe, and unpacks it if it begins as gzip's files do.
/// \throw FileError if it is missing, a directory or device, unreadable or empty, or packed but damaged or too large
std::string readWholeFile(const std::string& path);

/// The same for standard input, to its end. \throw FileError if it is a terminal, and as above
std::string readStandardInput();

/// Writes a whole file. \throw pcl::mrf::FileError, which OutputFiles::write adds the path to
void writeText(const std::string& path, const std::string& text);

/// The words as one text.
std::string joined(const std::vector<std::string>& words, const std::string& separator = ", ");

/// The same with "or" before the last one: "ply, obj or stl".
std::string alternatives(const std::vector<std::string>& words);

bool isOneOf(std::string_view word, const std::vector<std::string>& words);

/// Iterates over the lines of a text, without their ends: LF, CRLF, or CR in a text without the others.
class Lines {
public:
  /// \param path of the file, for messages
  explicit Lines(std::string_view text = {}, const std::string& path = {})
      : text_(text), path_(path), end_(text.find('\n') == std::string_view::npos ? '\r' : '\n')
  {}

  bool next(std::string_view& line);
  /// The words of the next line that has any. \param comment character that begins a comment; 0: none
  bool next(std::vector<std::string_view>& words, char comment = 0);
  std::string_view rest() const { return text_; }
  std::size_t number() const { return number_; } ///< of the last line, from 1
  /// \throw FileError about that line
  [[noreturn]] void fail(const std::string& cause) const;

private:
  std::string_view text_;
  std::string path_;
  char end_;
  std::size_t number_ = 0;
};

/// Takes the next word off a text, across line ends. \return empty at the end
std::string_view takeWord(std::string_view& text);

/// Splits a line at blanks and tabs, or at other separators.
void split(std::string_view line, std::vector<std::string_view>& words, std::string_view separators = " \t");

/// Splits a row of a table: at commas and semicolons, too.
void splitRow(std::string_view line, std::vector<std::string_view>& words);

/// True if commas separate some words of a row and blanks or semicolons others, as in "0,5 1,25".
/// \param words from splitRow(); their line must still exist
bool haveDecimalCommas(const std::vector<std::string_view>& words);

/// \return true if the whole word is a number (nan and inf are)
bool toNumber(std::string_view word, double& value);

/// \return true if the word is a whole number from 0, in digits alone
bool toCount(std::string_view word, std::int64_t& count);

/// \return true if the value is a whole number from 0 up to what std::int32_t holds, as numbers of vertices are
bool isCount(double value);

/// A to Z become a to z.
char lowerCase(char c);

/// a to z become A to Z.
std::string upperCase(std::string text);

/// True if two words differ in nothing but the case of their letters a to z.
bool equalsIgnoringCase(std::string_view a, std::string_view b);

/// \return false if one of the words is no number
bool toNumbers(const std::vector<std::string_view>& words, std::vector<double>& values);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "text_file.h"

#include "errors.h"
#include "gzip.h"

#include <base/byte_writer.h>
#include <base/memory.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>

#include <sys/stat.h>
#include <unistd.h>

namespace mrf_apps {

namespace {

/// The rest of a stream. \param size of the file; 0 for a pipe, whose size is unknown
std::string readAll(std::FILE* file, std::size_t size, const std::string& name)
{
  std::string text(size, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::string block(1 << 16, '\0');
  while (const std::size_t count = std::fread(block.data(), 1, block.size(), file))
    text.append(block, 0, count);
  if (std::ferror(file) != 0)
    throw FileError(name, "cannot be read");
  if (isGzip(text))
    text = unpackGzip(name, text, pcl::mrf::availableMemory() / 8);
  if (text.empty())
    throw FileError(name, "is empty; write it anew, or leave it out if there are other inputs");
  return text;
}

/// True if a number outside of the range of double is too close to zero, false if it is too large.
bool isTiny(std::string_view number)
{
  const std::size_t exponent = number.find_first_of("eE");
  if (exponent != std::string_view::npos)
    return number.substr(exponent + 1, 1) == "-";
  return number.find_first_of("123456789") > number.find('.');
}

} // namespace

char lowerCase(char c)
{
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

std::string upperCase(std::string text)
{
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

std::string extension(const std::string& path)
{
  const std::size_t dot = path.find_last_of("./");
  if (dot == std::string::npos || path[dot] == '/')
    return {};
  std::string result = path.substr(dot + 1);
  std::transform(result.begin(), result.end(), result.begin(), lowerCase);
  return result;
}

std::string unpackedExtension(const std::string& path)
{
  const std::string type = extension(path);
  return type == "gz" ? extension(path.substr(0, path.size() - 3)) : type;
}

std::string conversionHint(const std::string& path, const std::string& type)
{
  const std::string name = "'" + path + "'";
  return type == "vtk"   ? "; pcl_vtk2ply " + name + " mesh.ply makes a ply file of it"
         : type == "stl" ? "; it holds a mesh, not points: pcl_mrf_scan " + name + " cloud.ply samples points on it"
         : type == "vtp" ? "; ParaView saves it as ply"
         : type == "laz"
             ? "; laszip -i " + name + " -o cloud.las, or pdal translate " + name + " cloud.las, makes a las file of it"
         : type == "e57"
             ? "; CloudCompare -SILENT -C_EXPORT_FMT PLY -O " + name + " -SAVE_CLOUDS makes a ply file of it"
         : type == "rcp" || type == "rcs"  ? "; Autodesk ReCap exports it as pts"
         : type == "npts" || type == "pwn" ? "; call it xyz if its rows are x y z nx ny nz"
                                           : "";
}

std::string readWholeFile(const std::string& path)
{
  struct stat status;
  if (stat(path.c_str(), &status) != 0)
    throw FileError(path, std::strerror(errno));
  if (S_ISDIR(status.st_mode))
    throw FileError(path, "is a directory");
  if (S_ISCHR(status.st_mode) || S_ISBLK(status.st_mode)) // some of them have no end
    throw FileError(path, "is a device");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file)
    throw FileError(path, std::strerror(errno));
  return readAll(file.get(), static_cast<std::size_t>(status.st_size), path);
}

std::string readStandardInput()
{
  if (isatty(STDIN_FILENO) != 0)
    throw FileError("standard input", "is a terminal; give a file, or pipe one into it");
  return readAll(stdin, 0, "standard input");
}

void writeText(const std::string& path, const std::string& text)
{
  pcl::mrf::ByteWriter file(path);
  file.text(text);
  file.close();
}

std::string joined(const std::vector<std::string>& words, const std::string& separator)
{
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : separator) + word;
  return text;
}

std::string alternatives(const std::vector<std::string>& words)
{
  return joined({words.begin(), words.end() - 1}) + " or " + words.back();
}

bool isOneOf(std::string_view word, const std::vector<std::string>& words)
{
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool Lines::next(std::string_view& line)
{
  if (text_.empty())
    return false;
  const std::size_t end = text_.find(end_);
  line = text_.substr(0, end);
  text_.remove_prefix(end == std::string_view::npos ? text_.size() : end + 1);
  if (!line.empty() && line.back() == '\r')
    line.remove_suffix(1);
  ++number_;
  return true;
}

bool Lines::next(std::vector<std::string_view>& words, char comment)
{
  std::string_view line;
  for (words.clear(); words.empty();) {
    if (!next(line))
      return false;
    split(line.substr(0, comment == 0 ? std::string_view::npos : line.find(comment)), words);
  }
  return true;
}

void Lines::fail(const std::string& cause) const
{
  throw FileError(path_, number_, cause);
}

std::string_view takeWord(std::string_view& text)
{
  constexpr std::string_view blanks = " \t\r\n";
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(blanks));
  text.remove_prefix(word.size());
  return word;
}

void split(std::string_view line, std::vector<std::string_view>& words, std::string_view separators)
{
  words.clear();
  std::size_t begin = line.find_first_not_of(separators);
  while (begin != std::string_view::npos) {
    const std::size_t end = line.find_first_of(separators, begin);
    words.push_back(line.substr(begin, end == std::string_view::npos ? end : end - begin));
    begin = line.find_first_not_of(separators, end);
  }
}

void splitRow(std::string_view line, std::vector<std::string_view>& words)
{
  split(line, words, " \t,;");
}

bool haveDecimalCommas(const std::vector<std::string_view>& words)
{
  bool areJoined = false, areParted = false;
  for (std::size_t i = 1; i < words.size(); ++i) {
    const char* const end = words[i - 1].data() + words[i - 1].size();
    const std::string_view between(end, static_cast<std::size_t>(words[i].data() - end));
    areJoined = areJoined || between == ",";
    areParted = areParted || between.find(',') == std::string_view::npos;
  }
  return areJoined && areParted;
}

bool toNumber(std::string_view word, double& value)
{
  if (!word.empty() && word.front() == '+')
    word.remove_prefix(1);
  const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || result.ptr != word.data() + word.size())
    return false;
  if (result.ec == std::errc::result_out_of_range) {
    // from_chars has not set the value. Numbers too large for a double become infinite: refused or dropped later.
    value = isTiny(word) ? 0 : std::numeric_limits<double>::infinity();
    return true;
  }
  return result.ec == std::errc();
}

bool toCount(std::string_view word, std::int64_t& count)
{
  const auto result = std::from_chars(word.data(), word.data() + word.size(), count);
  return result.ec == std::errc() && result.ptr == word.data() + word.size() && count >= 0 && word.front() != '-';
}

bool isCount(double value)
{
  return value >= 0 && value <= std::numeric_limits<std::int32_t>::max() && value == std::floor(value);
}

bool equalsIgnoringCase(std::string_view a, std::string_view b)
{
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lowerCase(x) == lowerCase(y); });
}

bool toNumbers(const std::vector<std::string_view>& words, std::vector<double>& values)
{
  values.resize(words.size());
  for (std::size_t i = 0; i < words.size(); ++i)
    if (!toNumber(words[i], values[i]))
      return false;
  return true;
}

} // namespace mrf_apps

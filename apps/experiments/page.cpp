// SPDX-License-Identifier: BSD-3-Clause
#include "page.h"

#include "plot.h"
#include "support/text_file.h"

#include <cstdint>
#include <filesystem>

namespace mrf_apps {

using nlohmann::json;
using nlohmann::ordered_json;

namespace {

const char* const style = R"(
:root { color-scheme: light }
body { margin: 0; background: #fff; color: #1d2329; font: 15px/1.55 system-ui, "Segoe UI", Helvetica, Arial, sans-serif }
main { max-width: 1280px; margin: 0 auto; padding: 32px 28px 80px }
h1 { font-size: 27px; line-height: 1.25; margin: 0 0 14px; font-weight: 650 }
h2 { font-size: 21px; margin: 0 0 10px; font-weight: 650 }
h3 { font-size: 15px; margin: 26px 0 8px; font-weight: 650 }
p { max-width: 92ch; margin: 0 0 10px }
section { border-top: 1px solid #d5dade; margin-top: 44px; padding-top: 26px }
nav ol { columns: 2; column-gap: 40px; padding-left: 0; list-style: none; margin: 20px 0 0 }
nav a { color: #14558f; text-decoration: none }
nav a:hover { text-decoration: underline }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 1px 18px; margin: 0; font-size: 14px }
dt { color: #5d6872 }
dd { margin: 0 }
.wide { overflow-x: auto }
table { border-collapse: collapse; font-size: 12.5px; font-variant-numeric: tabular-nums }
th, td { padding: 4px 7px; border-bottom: 1px solid #e4e8eb; text-align: left; vertical-align: top }
th { border-bottom: 1px solid #8f9aa3; font-weight: 600; vertical-align: bottom; max-width: 96px }
td:first-child, td:nth-child(2) { white-space: nowrap }
td:first-child, th:first-child { padding-left: 0 }
td.number, th.number { text-align: right }
tbody tr:hover { background: #f4f6f8 }
.plots, .pictures { display: flex; flex-wrap: wrap; gap: 22px; margin: 22px 0 0 }
figure { margin: 0 }
.pictures figure { flex: 0 1 340px }
.pictures img { width: 100%; display: block; border: 1px solid #e4e8eb }
figcaption { font-size: 13px; color: #3d4750; margin-top: 5px }
svg text { font-family: inherit }
.note { background: #fff6dd; padding: 8px 12px }
)";

std::string base64(const std::string& bytes)
{
  const char* const digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string result;
  result.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t byte = 0; byte < 3; ++byte)
      group = group << 8 | (i + byte < bytes.size() ? static_cast<unsigned char>(bytes[i + byte]) : 0u);
    for (std::size_t digit = 0; digit < 4; ++digit)
      result += i + digit < bytes.size() + 1 ? digits[group >> (18 - 6 * digit) & 63] : '=';
  }
  return result;
}

/// A column of numbers is aligned at its right.
bool isNumeric(const Table& table, std::size_t column)
{
  bool hasNumber = false;
  for (const auto& row : table.rows)
    if (column < row.size() && !row[column].is_null()) {
      if (!row[column].is_number())
        return false;
      hasNumber = true;
    }
  return hasNumber;
}

std::string html(const Table& table)
{
  std::string result = "<h3>" + escaped(table.title) + "</h3>\n<div class=\"wide\"><table>\n<thead><tr>";
  std::vector<const char*> attributes;
  for (std::size_t column = 0; column < table.columns.size(); ++column) {
    attributes.push_back(isNumeric(table, column) ? " class=\"number\"" : "");
    result += std::string("<th") + attributes[column] + ">" + escaped(table.columns[column]) + "</th>";
  }
  result += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    result += "<tr>";
    for (std::size_t column = 0; column < row.size(); ++column)
      result += std::string("<td") + (column < attributes.size() ? attributes[column] : "") + ">" +
                escaped(cellText(row[column])) + "</td>";
    result += "</tr>\n";
  }
  return result + "</tbody>\n</table></div>\n";
}

std::string html(const Picture& picture, const std::string& folder)
{
  const std::filesystem::path path = std::filesystem::path(folder) / picture.file;
  if (!std::filesystem::is_regular_file(path))
    return {};
  return "<figure><img alt=\"" + escaped(picture.caption) + "\" src=\"data:image/png;base64," +
         base64(readWholeFile(path.string())) + "\"><figcaption>" + escaped(picture.caption) +
         "</figcaption></figure>\n";
}

std::string html(const Section& section, const std::string& folder)
{
  std::string result = "<section id=\"" + escaped(section.id) + "\">\n<h2>" + escaped(section.title) + "</h2>\n";
  for (const std::string& paragraph : section.paragraphs)
    result += "<p>" + escaped(paragraph) + "</p>\n";
  for (const Table& table : section.tables)
    result += html(table);
  std::string plots, pictures;
  for (const Plot& plot : section.plots)
    plots += "<figure>" + toSvg(plot) + "</figure>\n";
  for (const Picture& picture : section.pictures)
    pictures += html(picture, folder);
  if (!plots.empty())
    result += "<div class=\"plots\">\n" + plots + "</div>\n";
  if (!pictures.empty())
    result += "<div class=\"pictures\">\n" + pictures + "</div>\n";
  return result + "</section>\n";
}

std::string csvField(const std::string& text)
{
  if (text.find_first_of(",\"\r\n") == std::string::npos)
    return text;
  std::string result = "\"";
  for (const char c : text)
    result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

ordered_json toJson(const Plot& plot)
{
  ordered_json curves = ordered_json::array();
  for (const Curve& curve : plot.curves)
    curves.push_back({{"name", curve.name}, {"x", curve.x}, {"y", curve.y}});
  return {{"name", plot.name},     {"title", plot.title}, {"xLabel", plot.xLabel},
          {"yLabel", plot.yLabel}, {"curves", curves},    {"kind", plot.kind == Plot::Kind::bars ? "bars" : "lines"},
          {"logX", plot.logX},     {"logY", plot.logY}};
}

ordered_json toJson(const Section& section)
{
  ordered_json tables = ordered_json::array(), plots = ordered_json::array(), pictures = ordered_json::array();
  for (const Table& table : section.tables)
    tables.push_back({{"name", table.name}, {"title", table.title}, {"columns", table.columns}, {"rows", table.rows}});
  for (const Plot& plot : section.plots)
    plots.push_back(toJson(plot));
  for (const Picture& picture : section.pictures)
    pictures.push_back({{"file", picture.file}, {"caption", picture.caption}});
  return {{"id", section.id}, {"title", section.title}, {"paragraphs", section.paragraphs},
          {"tables", tables}, {"plots", plots},         {"pictures", pictures}};
}

} // namespace

std::string escaped(const std::string& text)
{
  std::string result;
  for (const char c : text)
    switch (c) {
    case '&':
      result += "&amp;";
      break;
    case '<':
      result += "&lt;";
      break;
    case '>':
      result += "&gt;";
      break;
    case '"':
      result += "&quot;";
      break;
    default:
      result += c;
    }
  return result;
}

std::string cellText(const json& cell)
{
  if (cell.is_null())
    return "–";
  if (cell.is_boolean())
    return cell.get<bool>() ? "yes" : "no";
  return cell.is_string() ? cell.get<std::string>() : cell.dump();
}

std::string toHtml(const Page& page, const std::string& folder)
{
  std::string result = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                       "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                       "<title>Markov random field surface reconstruction: experiments</title>\n<style>";
  result += style;
  result +=
      "</style>\n</head>\n<body>\n<main>\n<h1>Markov random field surface reconstruction: experiments</h1>\n<dl>\n";
  for (const auto& [name, value] : page.facts)
    result += "<dt>" + escaped(name) + "</dt><dd>" + escaped(value) + "</dd>\n";
  result += "</dl>\n";
  if (page.remaining > 0)
    result += "<p class=\"note\">The run that wrote this page was not over: " + std::to_string(page.remaining) +
              (page.remaining == 1 ? " experiment is" : " experiments are") + " missing.</p>\n";
  result += "<nav><ol>\n";
  for (const Section& section : page.sections)
    result += "<li><a href=\"#" + escaped(section.id) + "\">" + escaped(section.title) + "</a></li>\n";
  result += "</ol></nav>\n";
  for (const Section& section : page.sections)
    result += html(section, folder);
  return result + "</main>\n</body>\n</html>\n";
}

std::string toCsv(const Table& table)
{
  std::string result;
  for (std::size_t column = 0; column < table.columns.size(); ++column)
    result += (column > 0 ? "," : "") + csvField(table.columns[column]);
  result += "\n";
  for (const auto& row : table.rows) {
    for (std::size_t column = 0; column < row.size(); ++column)
      result += (column > 0 ? "," : "") + (row[column].is_null() ? std::string() : csvField(cellText(row[column])));
    result += "\n";
  }
  return result;
}

ordered_json toJson(const Page& page)
{
  ordered_json facts = ordered_json::object(), sections = ordered_json::array();
  for (const auto& [name, value] : page.facts)
    facts[name] = value;
  for (const Section& section : page.sections)
    sections.push_back(toJson(section));
  return {{"facts", facts}, {"remaining", page.remaining}, {"sections", sections}};
}

} // namespace mrf_apps

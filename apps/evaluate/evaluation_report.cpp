// SPDX-License-Identifier: BSD-3-Clause
#include "sigma_evaluation.h"
#include "support/report_json.h"

#include <nlohmann/json.hpp>

#include <array>
#include <cstdio>

namespace mrf_apps {

using nlohmann::ordered_json;

MRF_JSON(Statistics, count, rms, mean, median, percentile95, max)
MRF_JSON(ReferenceComparison, hausdorff, hausdorffPercent, inventedShare, missingShare, normalDeviation, flippedShare,
         areaRatio)
MRF_JSON(SensorComparison, missingShare, inFrontShare, rms, rmsPercent, rmsInLimits, medianNormalError, flippedShare,
         areaRatio, inFrontAreaShare)
MRF_JSON(SigmaStatistics, count, levels, coverage, rmsError, medianHalfWidth, negativeLogLikelihood)
MRF_JSON(Sparsification, sigma, confidence)
MRF_JSON(SigmaEvaluation, measured, fillings, sparsification, notKnown)

namespace {

ordered_json toJson(const LocalComparison& local)
{
  ordered_json json = {{"spacing", local.spacing}, {"unevenness", local.unevenness}, {"cloudRms", local.cloudRms}};
  if (local.heldOutRms)
    json["heldOutRms"] = *local.heldOutRms;
  json["nearLimit"] = LocalComparison::nearLimit;
  json["nearShare"] = local.nearShare;
  json["inventedLimit"] = LocalComparison::inventedLimit;
  json["inventedShare"] = local.inventedShare;
  if (local.flippedShare)
    json["flippedShare"] = *local.flippedShare;
  return json;
}

/// A cell of a table, flush right.
std::string cell(const std::string& text)
{
  constexpr std::size_t width = 13;
  return std::string(text.size() < width ? width - text.size() : 1, ' ') + text;
}

std::string cell(const ordered_json& value)
{
  if (!value.is_number_float())
    return cell(value.is_string() ? value.get<std::string>() : value.dump());
  std::array<char, 32> digits;
  std::snprintf(digits.data(), digits.size(), "%.6g", value.get<double>());
  return cell(std::string(digits.data()));
}

std::string line(const std::string& indent, const std::string& name, const std::string& cells)
{
  constexpr std::size_t width = 26;
  const std::string label = indent + name;
  return label + std::string(label.size() < width ? width - label.size() : 0, ' ') + cells + "\n";
}

} // namespace

ordered_json toJson(const SigmaEvaluation& evaluation)
{
  return evaluation;
}

ordered_json toJson(const Evaluation& evaluation)
{
  ordered_json json;
  json["diagonal"] = evaluation.options.diagonal;
  json["diagonalSource"] = evaluation.diagonalSource;
  json["farLimit"] = evaluation.options.farLimit;
  json["samples"] = evaluation.options.samples;
  json["seed"] = evaluation.options.seed;
  json["pointsNotFinite"] = evaluation.pointsNotFinite;
  const double percent = 100 / evaluation.options.diagonal;
  const auto addDistances = [&](const std::string& name, const std::optional<Statistics>& distances) {
    if (!distances)
      return;
    json["distances"][name] = *distances;
    ordered_json& inPercent = json["distances"][name + "Percent"] = *distances;
    for (const char* length : {"rms", "mean", "median", "percentile95", "max"})
      inPercent[length] = percent * inPercent[length].get<double>();
  };
  addDistances("cloud", evaluation.cloud);
  addDistances("heldOut", evaluation.heldOut);
  addDistances("clean", evaluation.clean);
  if (evaluation.reference) {
    addDistances("meshToReference", evaluation.reference->meshToReference);
    addDistances("referenceToMesh", evaluation.reference->referenceToMesh);
    json["reference"] = *evaluation.reference;
  }
  if (evaluation.sensor)
    json["sensor"] = *evaluation.sensor;
  if (evaluation.local)
    json["local"] = toJson(*evaluation.local);
  json["mesh"] = toJson(evaluation.mesh);
  json["mesh"]["selfIntersectingTriangles"] = evaluation.selfIntersectingTriangles;
  json["mesh"]["areaVariance"] = evaluation.areaVariance();
  json["mesh"]["areas"] = evaluation.areas;
  json["mesh"]["areaStep"] = Evaluation::areaStep;
  return json;
}

std::string toText(const ordered_json& json, const std::string& indent)
{
  std::string text;
  std::string columns; // headings of the table that is being printed
  for (const auto& [name, value] : json.items()) {
    if (value.is_array())
      continue; // histograms are for programs
    if (!value.is_object()) {
      text += line(indent, name, cell(value));
      continue;
    }
    if (!value.contains("count")) {
      text += (indent.empty() ? "\n" : "") + line(indent, name, "") + toText(value, indent + "  ");
      continue;
    }
    std::string heads, cells;
    for (const auto& [head, figure] : value.items())
      if (!figure.is_array()) {
        heads += cell(head);
        cells += cell(figure);
      } else if (head == "coverage")
        for (std::size_t level = 0; level < figure.size(); ++level) {
          heads += cell("in " + value["levels"][level].dump());
          cells += cell(figure[level]);
        }
    if (heads != columns)
      text += line("", "", heads);
    columns = heads;
    text += line(indent, name, cells);
  }
  return text;
}

} // namespace mrf_apps

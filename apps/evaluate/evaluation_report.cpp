// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation_report.h"

#include "support/report_json.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <utility>

namespace mrf_apps {
namespace {

using nlohmann::ordered_json;

struct Row {
  const char* label;
  const char* name; ///< in JSON
  Statistics values;
};

/// The distances that were measured, in the order of the table.
std::vector<Row> distanceRows(const Evaluation& evaluation)
{
  std::vector<Row> rows;
  if (evaluation.cloud)
    rows.push_back({"input -> mesh (accuracy)", "cloud", *evaluation.cloud});
  if (evaluation.heldOut)
    rows.push_back({"held out -> mesh (holes)", "heldOut", *evaluation.heldOut});
  if (evaluation.clean)
    rows.push_back({"noise-free -> mesh", "clean", *evaluation.clean});
  if (evaluation.reference) {
    rows.push_back({"mesh -> reference", "meshToReference", evaluation.reference->meshToReference});
    rows.push_back({"reference -> mesh", "referenceToMesh", evaluation.reference->referenceToMesh});
  }
  return rows;
}

const char* nameOf(DiagonalSource source)
{
  switch (source) {
  case DiagonalSource::option:
    return "given";
  case DiagonalSource::reference:
    return "reference";
  case DiagonalSource::cloud:
    return "input cloud";
  case DiagonalSource::mesh:
    return "mesh";
  }
  return "?";
}

Statistics scaled(Statistics values, double factor)
{
  for (double* value : {&values.rms, &values.mean, &values.median, &values.percentile95, &values.max})
    *value *= factor;
  return values;
}

class Text {
public:
  __attribute__((format(printf, 2, 3))) void add(const char* format, ...)
  {
    va_list arguments;
    va_start(arguments, format);
    char line[256];
    std::vsnprintf(line, sizeof(line), format, arguments);
    va_end(arguments);
    text_ += line;
  }

  void addStatistics(const char* label, const Statistics& s)
  {
    add("  %-26s %9lld %10.4g %10.4g %10.4g %10.4g %10.4g\n", label, static_cast<long long>(s.count), s.rms, s.mean,
        s.median, s.percentile95, s.max);
  }

  void addHeading(const char* heading)
  {
    add("%-28s %9s %10s %10s %10s %10s %10s\n", heading, "number", "RMS", "mean", "median", "95 %", "max");
  }

  /// One bin of a histogram; the longest bar is 40 characters.
  void addBin(const std::string& label, std::int64_t count, std::int64_t all, std::int64_t max)
  {
    const double share = all > 0 ? static_cast<double>(count) / static_cast<double>(all) : 0;
    const auto length = max > 0 ? static_cast<std::size_t>(40 * count / max) : 0;
    add("  %-11s %9lld %6.2f %%  %s\n", label.c_str(), static_cast<long long>(count), 100 * share,
        std::string(length, '#').c_str());
  }

  std::string take() { return std::move(text_); }

private:
  std::string text_;
};

void addDistances(const Evaluation& evaluation, Text& text)
{
  const std::vector<Row> rows = distanceRows(evaluation);
  if (rows.empty())
    return;
  text.addHeading("distances, cloud's unit");
  for (const Row& row : rows)
    text.addStatistics(row.label, row.values);
  text.addHeading("distances, % of diagonal");
  for (const Row& row : rows)
    text.addStatistics(row.label, scaled(row.values, 100 / evaluation.options.diagonal));
  if (evaluation.pointsNotFinite > 0)
    text.add("  %lld points are not finite and were left out\n", static_cast<long long>(evaluation.pointsNotFinite));
  text.add("\n");
}

void addLocal(const LocalComparison& local, Text& text)
{
  text.add("local spacings: .313 x distance to the 8th neighbor in the input; median %.6g, 90 / 10 %% %.3g\n",
           local.spacing, local.unevenness);
  text.add("  %-26s %10.4g median spacings RMS\n", "input -> mesh", local.cloudRms);
  if (local.heldOutRms)
    text.add("  %-26s %10.4g median spacings RMS\n", "held out -> mesh", *local.heldOutRms);
  text.add("  %-26s %10.3f %% of the input's points within %g spacings of the mesh\n", "near", 100 * local.nearShare,
           LocalComparison::nearLimit);
  text.add("  %-26s %10.3f %% of the mesh's area beyond %g spacings of the input\n", "invented",
           100 * local.inventedShare, LocalComparison::inventedLimit);
  if (local.flippedShare)
    text.add("  %-26s %10.3f %% of the input's normals, against the nearest triangle\n", "flipped",
             100 * *local.flippedShare);
  text.add("\n");
}

void addReference(const ReferenceComparison& comparison, const EvaluationOptions& options, Text& text)
{
  text.addHeading("normals, degrees");
  text.addStatistics("mesh to reference", comparison.normalDeviation);
  text.add("  %.3f %% turned by more than 90\n\n", 100 * comparison.flippedShare);
  text.add("beyond %.6g (%.3g %% of diagonal) of the other surface\n", options.farLimit,
           100 * options.farLimit / options.diagonal);
  text.add("  invented  %8.3f %% of the mesh's area\n", 100 * comparison.inventedShare);
  text.add("  missing   %8.3f %% of the reference's area\n", 100 * comparison.missingShare);
  text.add("  Hausdorff %.6g = %.4g %% of diagonal\n\n", comparison.hausdorff,
           100 * comparison.hausdorff / options.diagonal);
}

void addMesh(const Evaluation& evaluation, Text& text)
{
  const pcl::mrf::MeshStatistics& mesh = evaluation.mesh;
  text.add("mesh\n");
  const std::pair<const char*, std::int64_t> counts[] = {{"components", mesh.components},
                                                         {"Euler characteristic", mesh.eulerCharacteristic},
                                                         {"boundary loops", mesh.boundaryLoops},
                                                         {"boundary edges", mesh.boundaryEdges},
                                                         {"non-manifold edges", mesh.nonManifoldEdges},
                                                         {"non-manifold vertices", mesh.nonManifoldVertices},
                                                         {"degenerate triangles", mesh.degenerateTriangles},
                                                         {"self-intersecting", evaluation.selfIntersectingTriangles},
                                                         {"unused vertices", mesh.unusedVertices}};
  text.add("  %-22s %9lld\n  %-22s %9lld\n", "vertices", static_cast<long long>(mesh.vertices), "triangles",
           static_cast<long long>(mesh.triangles));
  for (const auto& [label, count] : counts)
    text.add("  %-22s %9lld\n", label, static_cast<long long>(count));
  text.add("  %-22s %9.6g\n", "area", mesh.area);
  if (mesh.closed())
    text.add("  %-22s %9.6g\n", "volume", mesh.volume);
  text.add("  %-22s %9.4g\n  %-22s %9.4g\n", "mean quality", mesh.meanQuality, "least quality", mesh.minQuality);
  text.add("  %-22s %9.4g\n", "mean edge", mesh.meanEdge);
  text.add("  %-22s %9.4g\n", "area deviation / mean", mesh.areaDeviation);
  text.add("  %-22s %9.4g\n\n", "area variance / mean^2", evaluation.areaVariance());
}

/// All bins of a histogram of triangles.
template <typename Bins>
void addTriangleBins(const Bins& bins, double step, bool isLastOpen, std::int64_t triangles, Text& text)
{
  const std::int64_t max = *std::max_element(bins.begin(), bins.end());
  for (std::size_t bin = 0; bin < bins.size(); ++bin) {
    char label[32];
    const double lower = static_cast<double>(bin) * step;
    if (isLastOpen && bin + 1 == bins.size())
      std::snprintf(label, sizeof(label), ">= %.2f", lower);
    else
      std::snprintf(label, sizeof(label), "%.2f - %.2f", lower, lower + step);
    text.addBin(label, bins[bin], triangles, max);
  }
}

void addHistograms(const Evaluation& evaluation, Text& text)
{
  const auto& qualities = evaluation.qualities;
  text.add("triangles by quality (2 inradius / circumradius)\n");
  addTriangleBins(qualities, 1. / static_cast<double>(qualities.size()), false, evaluation.mesh.triangles, text);
  text.add("triangles by area / mean area\n");
  addTriangleBins(evaluation.areas, Evaluation::areaStep, true, evaluation.mesh.triangles, text);
  const auto& valences = evaluation.mesh.valences;
  text.add("vertices by number of edges\n");
  const std::int64_t maxEdges = *std::max_element(valences.begin(), valences.end());
  for (std::size_t valence = 0; valence < valences.size(); ++valence)
    if (valences[valence] > 0)
      text.addBin((valence + 1 < valences.size() ? "" : ">= ") + std::to_string(valence), valences[valence],
                  evaluation.mesh.vertices, maxEdges);
}

ordered_json toJson(const Statistics& s)
{
  return {{"count", s.count}, {"rms", s.rms}, {"mean", s.mean}, {"median", s.median}, {"percentile95", s.percentile95},
          {"max", s.max}};
}

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

ordered_json toJson(const SigmaStatistics& s)
{
  return {{"count", s.count},
          {"levels", SigmaStatistics::levels},
          {"coverage", s.coverage},
          {"rmsError", s.rmsError},
          {"medianHalfWidth", s.medianHalfWidth},
          {"negativeLogLikelihood", s.negativeLogLikelihood}};
}

} // namespace

std::string toText(const SigmaEvaluation& evaluation)
{
  Text text;
  text.add("\nsigma         number   in 50 %%   in 80 %%   in 95 %%  RMS error  half-width   -log lik.\n");
  const std::pair<const char*, const SigmaStatistics&> rows[] = {{"measured", evaluation.measured},
                                                                 {"fillings", evaluation.fillings}};
  for (const auto& [label, s] : rows)
    if (s.count > 0)
      text.add("  %-8s %9lld %9.1f%% %8.1f%% %8.1f%% %10.4g  %10.4g  %10.3f\n", label, static_cast<long long>(s.count),
               100 * s.coverage[0], 100 * s.coverage[1], 100 * s.coverage[2], s.rmsError, s.medianHalfWidth,
               s.negativeLogLikelihood);
  text.add("  area between the sparsification curve and the errors' own: by sigma %.4f, by confidence %.4f\n",
           evaluation.sparsification.sigma, evaluation.sparsification.confidence);
  if (evaluation.notKnown > 0)
    text.add("  %lld places without sigma or error were left out\n", static_cast<long long>(evaluation.notKnown));
  return text.take();
}

nlohmann::ordered_json toJson(const SigmaEvaluation& evaluation)
{
  return {{"measured", toJson(evaluation.measured)},
          {"fillings", toJson(evaluation.fillings)},
          {"sparsification",
           {{"sigma", evaluation.sparsification.sigma}, {"confidence", evaluation.sparsification.confidence}}},
          {"notKnown", evaluation.notKnown}};
}

std::string toText(const Evaluation& evaluation)
{
  Text text;
  text.add("diagonal %.9g (%s)\n\n", evaluation.options.diagonal, nameOf(evaluation.diagonalSource));
  addDistances(evaluation, text);
  if (evaluation.local)
    addLocal(*evaluation.local, text);
  if (evaluation.reference)
    addReference(*evaluation.reference, evaluation.options, text);
  addMesh(evaluation, text);
  addHistograms(evaluation, text);
  return text.take();
}

nlohmann::ordered_json toJson(const Evaluation& evaluation)
{
  ordered_json json;
  json["diagonal"] = evaluation.options.diagonal;
  json["diagonalSource"] = nameOf(evaluation.diagonalSource);
  json["farLimit"] = evaluation.options.farLimit;
  json["samples"] = evaluation.options.samples;
  json["seed"] = evaluation.options.seed;
  json["pointsNotFinite"] = evaluation.pointsNotFinite;
  for (const Row& row : distanceRows(evaluation)) {
    json["distances"][row.name] = toJson(row.values);
    json["distances"][std::string(row.name) + "Percent"] =
        toJson(scaled(row.values, 100 / evaluation.options.diagonal));
  }
  if (evaluation.reference) {
    const ReferenceComparison& comparison = *evaluation.reference;
    json["reference"]["hausdorff"] = comparison.hausdorff;
    json["reference"]["hausdorffPercent"] = 100 * comparison.hausdorff / evaluation.options.diagonal;
    json["reference"]["inventedShare"] = comparison.inventedShare;
    json["reference"]["missingShare"] = comparison.missingShare;
    json["reference"]["normalDeviation"] = toJson(comparison.normalDeviation);
    json["reference"]["flippedShare"] = comparison.flippedShare;
  }
  if (evaluation.local)
    json["local"] = toJson(*evaluation.local);
  json["mesh"] = toJson(evaluation.mesh);
  json["mesh"]["selfIntersectingTriangles"] = evaluation.selfIntersectingTriangles;
  json["mesh"]["qualities"] = evaluation.qualities;
  json["mesh"]["areaVariance"] = evaluation.areaVariance();
  json["mesh"]["areas"] = evaluation.areas;
  json["mesh"]["areaStep"] = Evaluation::areaStep;
  return json;
}

} // namespace mrf_apps

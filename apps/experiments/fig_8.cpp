// SPDX-License-Identifier: BSD-3-Clause
#include "comparisons.h"
#include "figure_support.h"
#include "noise.h"
#include "patches.h"

#include <algorithm>
#include <cmath>

namespace mrf_apps {

using namespace figures;
using nlohmann::json;
using pcl::mrf::ObservationKind;
using pcl::mrf::Options;
using pcl::mrf::scan::Length;
using pcl::mrf::scan::Scan;
using pcl::mrf::scan::ScanOptions;

namespace {

struct Setting {
  std::string id, title;
  ScanOptions scan;
};

std::vector<double> betas(bool isQuick)
{
  return isQuick ? std::vector<double>{.99, .1} : std::vector<double>{.99, .5, .1, .05};
}

/// A scanned object with fine structure, and one with edges, thin parts and parts of several sizes.
std::vector<ScanObject> smoothedObjects(const ExperimentOptions& options)
{
  std::vector<ScanObject> result = {scanObjects(options).front()};
  if (options.quick)
    return result;
  const auto shape = std::make_shared<Lazy<LoadedObject>>([] { return loadShape("primitives"); });
  result.push_back(
      {"primitives", "primitives (8 parts)", "generated", [shape]() -> const LoadedObject& { return (*shape)(); }});
  return result;
}

json measureCase(Laboratory& laboratory, const std::string& key, const NoisyMethod& method, const ScanObject& object,
                 Lazy<Scan>& scan)
{
  return laboratory.measure("fig-8/" + key + "/" + object.id + "/" + method.id,
                            [&] { return measureNoisy(method, object.load(), scan(), laboratory.execution()); });
}

json number(const json& measured, const char* name, int digits = 3)
{
  const auto found = measured.find(name);
  return found != measured.end() && found->is_number() ? json(rounded(*found, digits)) : json();
}

/// What both tables of methods show of a case; a failure is a word in its first cell.
const std::vector<std::string>& resultColumns()
{
  static const std::vector<std::string> columns = {"points' true places to surface, RMS % of the diagonal",
                                                   "surface to object, RMS % of the diagonal", "invented area %",
                                                   "components", "CPU s"};
  return columns;
}

void addResult(std::vector<json>& row, const json& measured)
{
  if (measured.contains("failed")) {
    row.push_back("failed: " + measured["failed"].get<std::string>());
    return;
  }
  for (const char* name : {"accuracy", "reference"})
    row.push_back(number(measured, name));
  row.push_back(number(measured, "invented", 2));
  row.push_back(measured["components"]);
  row.push_back(number(measured, "processorSeconds", 2));
}

Table resultTable(const std::string& name, const std::string& title, std::vector<std::string> columns)
{
  columns.insert(columns.end(), resultColumns().begin(), resultColumns().end());
  return {name, title, columns, {}};
}

/// The same value at both ends of the betas: a method that has none.
void addLine(Plot& plot, const std::string& name, const json& measured, const std::vector<double>& at)
{
  if (!measured.contains("failed"))
    plot.curves.push_back({name, {at.back(), at.front()}, {measured["accuracy"], measured["accuracy"]}});
}

/// Two pictures of the first object under noise of one spacing, colored by the distance to the true surface.
void addPictures(Laboratory& laboratory, Section& section, const ScanObject& object, Lazy<Scan>& scan,
                 const std::vector<std::pair<NoisyMethod, json>>& pictured)
{
  constexpr double limitPercent = 1;
  PictureOptions picture;
  picture.width = picture.height = 800;
  picture.legend = errorLegend("distance to the true surface, % of the diagonal", limitPercent);
  for (const auto& [method, measured] : pictured) {
    if (measured.contains("failed"))
      continue;
    const std::string file = "fig-8-" + method.id + ".png";
    laboratory.draw(file, picture, [&, run = method.run] {
      SurfaceMesh mesh = run(scan(), laboratory.execution()).mesh;
      mesh.colors.clear();
      for (const double error : object.load().distances(mesh.vertices, laboratory.execution()))
        mesh.colors.push_back(errorColor(error, limitPercent / 100 * scan().diagonal));
      return mesh;
    });
    section.pictures.push_back({file, object.title + ", noise of one mean spacing. " + method.title + ": RMS " +
                                          text(measured["accuracy"]) + " % of the diagonal"});
  }
}

void addNoise(Laboratory& laboratory, Section& section)
{
  const bool isQuick = laboratory.options().quick;
  const std::vector<double> allBetas = betas(isQuick);
  const std::vector<ScanObject> all = smoothedObjects(laboratory.options());
  Table table = resultTable("fig-8-noise", "Noise along the normal", {"object", "noise, spacings", "method"});
  table.columns.emplace_back("points' true places to surface, RMS spacings");
  Table chosen{"fig-8-chosen",
               "What the default found in the data, mean spacings",
               {"object", "true noise", "estimated noise", "smoothing length"},
               {}};
  for (const ScanObject& object : all)
    for (const double noise : isQuick ? std::vector<double>{1} : std::vector<double>{.5, 1, 2}) {
      ScanOptions options = baseScan(laboratory.options());
      options.noise = {noise, Length::Unit::spacings};
      Lazy<Scan> scan([&] { return simulateScan(*object.load().surface, options, laboratory.execution()); });
      const auto measure = [&](const NoisyMethod& method) {
        json measured = laboratory.measure("fig-8/noise-" + text(noise) + "/" + object.id + "/" + method.id, [&] {
          json result = measureNoisy(method, object.load(), scan(), laboratory.execution());
          // The spacing depends on the object: kept with the result, so that an earlier run's scan is not needed.
          result["inSpacings"] = result["accuracy"].get<double>() / 100 * scan().diagonal / scan().spacing;
          return result;
        });
        std::vector<json> row = {object.title, noise, method.title};
        addResult(row, measured);
        if (!measured.contains("failed"))
          row.push_back(number(measured, "inSpacings"));
        table.rows.push_back(row);
        return measured;
      };

      Plot plot = emptyPlot(Plot::Kind::lines, "fig-8-" + object.id + "-" + text(noise),
                            object.title + ", noise of " + text(noise) + " mean spacings", "beta",
                            "RMS error, % of the diagonal");
      const NoisyMethod ours = defaultOnNoise();
      const json byDefault = measure(ours);
      addLine(plot, ours.title, byDefault, allBetas);
      if (!byDefault.contains("failed"))
        chosen.rows.push_back({object.title, noise, number(byDefault, "noise"), number(byDefault, "smoothing")});
      // What a failure of the default is due to: the length that it chose, or the normals that it oriented.
      measure(oursOnNoise("known", "this, told the noise", [noise](Options& changed, double spacing) {
        changed.observation.noise = static_cast<float>(noise * spacing);
      }));
      measure(peerOnNoise(mrf_apps::ours("facing", "this, each normal facing its sensor", [](Options&, double) {})));
      std::vector<std::pair<NoisyMethod, json>> pictured = {{ours, byDefault}};
      for (const ObservationKind kind : {ObservationKind::median, ObservationKind::mean}) {
        Curve curve;
        curve.name = kind == ObservationKind::median ? "voxel-wise median, k = 2" : "voxel-wise mean, k = 2";
        for (const double beta : allBetas) {
          const NoisyMethod method = voxelwiseOnNoise(kind, beta);
          const json measured = measure(method);
          if (pictured.size() == 1)
            pictured.emplace_back(method, measured);
          if (measured.contains("failed"))
            continue;
          curve.x.push_back(beta);
          curve.y.push_back(measured["accuracy"]);
        }
        plot.curves.push_back(curve);
      }
      for (const Method& peer : {poissonMethod(), hoppeMethod()}) {
        const NoisyMethod method = peerOnNoise(peer);
        addLine(plot, method.title, measure(method), allBetas);
      }
      section.plots.push_back(plot);
      if (noise == 1 && object.id == all.front().id)
        addPictures(laboratory, section, object, scan, pictured);
    }
  section.tables.push_back(chosen);
  section.tables.push_back(table);
}

void addOutliers(Laboratory& laboratory, Section& section)
{
  std::vector<Setting> settings;
  for (const double percent : laboratory.options().quick ? std::vector<double>{5} : std::vector<double>{0, 1, 2, 5}) {
    ScanOptions scan = baseScan(laboratory.options());
    scan.uniformOutliers = percent;
    settings.push_back({"outliers-" + text(percent), text(percent) + " % anywhere", scan});
  }
  ScanOptions clustered = baseScan(laboratory.options());
  clustered.clusteredOutliers = 1;
  settings.push_back({"clusters-1", "1 % in clusters", clustered});

  Table table =
      resultTable("fig-8-outliers", "Outliers, without noise on the other points", {"object", "outliers", "method"});
  const std::vector<NoisyMethod> methods = {defaultOnNoise(), voxelwiseOnNoise(ObservationKind::median, .99),
                                            peerOnNoise(poissonMethod()), peerOnNoise(hoppeMethod()),
                                            peerOnOurPoints(poissonMethod())};
  for (const ScanObject& object : smoothedObjects(laboratory.options()))
    for (const Setting& setting : settings) {
      Lazy<Scan> scan([&] { return simulateScan(*object.load().surface, setting.scan, laboratory.execution()); });
      for (const NoisyMethod& method : methods) {
        std::vector<json> row = {object.title, setting.title, method.title};
        addResult(row, measureCase(laboratory, setting.id, method, object, scan));
        table.rows.push_back(row);
      }
    }
  section.tables.push_back(table);
}

void addNoisyScans(Laboratory& laboratory, Section& section)
{
  const std::vector<NoisyMethod> methods = {defaultOnNoise(),
                                            peerOnNoise(poissonMethod()),
                                            peerOnNoise(hoppeMethod()),
                                            peerOnOurPoints(poissonMethod()),
                                            peerOnOurPoints(hoppeMethod()),
                                            oursOnNoise("exact", "this, all levels whole and exact", solveExactly)};
  std::vector<PatchResults> results(methods.size());
  std::vector<std::vector<Pair>> pairs(methods.size());
  const std::vector<ScanObject> all = noisyObjects(laboratory.options());
  const int scans = laboratory.options().quick ? 1 : 2;
  int group = 0;
  for (const ScanObject& object : all)
    for (int index = 0; index < scans; ++index, ++group) {
      const ScanOptions options = noisyScan(laboratory.options(), index);
      Lazy<Scan> scan([&] { return simulateScan(*object.load().surface, options, laboratory.execution()); });
      json byDefault;
      for (std::size_t m = 0; m < methods.size(); ++m) {
        const json measured = measureCase(laboratory, "noisy-scan-" + std::to_string(index), methods[m], object, scan);
        results[m].add(measured);
        if (m == 0)
          byDefault = measured;
        addPairs(byDefault, measured, group, pairs[m]);
      }
    }

  std::string names;
  for (const ScanObject& object : all)
    names += (names.empty() ? "" : ", ") + object.title;
  Table table{
      "fig-8-noisy-scans", "Noisy scans with holes (" + names + "): errors in % of the diagonal", {"method"}, {}};
  for (const std::string& column : patchColumns())
    table.columns.push_back(column);
  for (const char* column : {"hole by hole: median of the default's error / its", "95 % from", "to"})
    table.columns.emplace_back(column);
  for (std::size_t m = 0; m < methods.size(); ++m) {
    std::vector<json> row = {methods[m].title};
    for (const json& cell : patchCells(results[m]))
      row.push_back(cell);
    const Comparison comparison = compare(pairs[m], 1);
    for (const double value : {comparison.medianRatio, comparison.lower, comparison.upper})
      row.push_back(m > 0 && comparison.pairs > 0 ? json(rounded(value)) : json());
    table.rows.push_back(row);
  }
  section.tables.push_back(table);
}

} // namespace

Section fig8(Laboratory& laboratory)
{
  Section section{"fig-8", "Fig. 8: noise and outliers", {}, {}, {}, {}};
  const ExperimentOptions& options = laboratory.options();
  section.paragraphs = {
      "Scans from 12 views, of " + std::to_string(baseScan(options).sampling.points) +
          " points each, without normals: this method estimates them and turns them to the sensors. Others are given "
          "all points, with normals of planes fitted to their neighbors, each facing the sensor that saw its point. "
          "\"On the default's points\" means that they are given what the first stage of the default leaves: no "
          "outliers, consistent normals.",
      "The error is the distance of the surface from where the scanned points truly are, before noise; holes that the "
      "views leave do not count, invented surface has its own column: the share of the mesh's area farther than 1 % "
      "of the diagonal from the object.",
      "Noise. As in the paper's figure, beta is lowered against noise, with voxel-wise observations and k = 2. It is "
      "read as the paper's program reads it, which weighs the data by 42 W; a b of the paper's text for Eq. 6 "
      "(--energy paper-text, 36/7 W) smooths as 6 b / (49 - 43 b) does here. The "
      "default has no beta: it observes at the points, and chooses its smoothing length by points that it left out. "
      "It is a horizontal line in the plots, as are methods without such a parameter; lower is better. The first "
      "table shows what it found beside the truth. Two rows tell what its errors come from: told the noise, it does "
      "not choose its smoothing length; given normals that each face their sensor, as the other methods are, it does "
      "not make them consistent with each other.",
      "Noisy scans: noise with a standard deviation of 0.25 % of the diagonal, 1 % outliers, " +
          std::to_string(holesOfNoisyScan) +
          " holes per scan with radii of 4 to 10 %. A ratio below 1 means that the default fills the holes better."};
  if (options.quick)
    section.paragraphs.push_back("Quick: one object, one level of noise, fewer points and settings.");
  addNoise(laboratory, section);
  addOutliers(laboratory, section);
  addNoisyScans(laboratory, section);
  return section;
}

} // namespace mrf_apps

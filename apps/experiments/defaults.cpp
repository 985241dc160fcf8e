// SPDX-License-Identifier: BSD-3-Clause
#include "comparisons.h"
#include "field/prior.h"
#include "figure_support.h"
#include "patches.h"

namespace mrf_apps {

using figures::Lazy;
using figures::rounded;
using figures::text;
using nlohmann::json;
using pcl::mrf::ObservationKind;
using pcl::mrf::Options;
using pcl::mrf::Prior;
using pcl::mrf::Trimming;
using pcl::mrf::scan::Scan;

namespace {

/// One option away from its default.
struct Variation {
  std::string option, value;
  Change change;
};

/// One line for each setting that is tried.
std::vector<Variation> variations()
{
  std::vector<Variation> result = {{"default", "", [](Options&, double) {}}};
  const auto add = [&](const std::string& option, const std::string& value, const Change& change) {
    result.push_back({option, value, change});
  };
  const auto estimate = [&](const std::string& value, ObservationKind kind) {
    add("estimate", value, [kind](Options& options, double) { options.observation.kind = kind; });
  };
  estimate("points", ObservationKind::points);
  estimate("median", ObservationKind::median);
  estimate("mean", ObservationKind::mean);
  estimate("nearest", ObservationKind::nearest);
  estimate("plane", ObservationKind::plane);
  estimate("trapezoid", ObservationKind::trapezoid);
  for (const Prior prior : figures::allPriors)
    add("k", std::to_string(order(prior)), [prior](Options& options, double) { options.prior.kind = prior; });
  for (const double length : {.4, .6, .8, 1.2})
    add("smoothing, spacings", text(length), [length](Options& options, double spacing) {
      options.observation.smoothing = static_cast<float>(length * spacing);
    });
  for (const float weight : {.1f, .4f, 1.5f})
    add("gradient weight", text(weight),
        [weight](Options& options, double) { options.observation.gradientWeight = weight; });
  for (const double reach : {2.5, 3., 3.25, 4.})
    add("plane: dEmax, spacings", text(reach), [reach](Options& options, double spacing) {
      options.observation.kind = ObservationKind::plane;
      options.observation.maxDistance = static_cast<float>(reach * spacing);
    });
  for (const float beta : {.9f, .95f, .99f, .999f})
    add("plane: beta", text(beta), [beta](Options& options, double) {
      options.observation.kind = ObservationKind::plane;
      options.prior.beta = beta;
    });
  for (const double voxel : {1.5, 2., 3.})
    add("voxel, spacings", text(voxel), [voxel](Options& options, double spacing) {
      options.multiscale.voxelSize = static_cast<float>(voxel * spacing);
    });
  for (const int padding : {4, 6, 12, 24})
    add("padding, voxels", std::to_string(padding),
        [padding](Options& options, double) { options.multiscale.padding = padding; });
  for (const float share : {0.f, .001f, .003f, .01f})
    add("least component, share of the points", text(share),
        [share](Options& options, double) { options.orientation.minComponentShare = share; });
  add("trimming", "none", [](Options& options, double) { options.trimming.kind = Trimming::none; });
  add("trimming", "holes", [](Options& options, double) { options.trimming.kind = Trimming::holes; });
  add("trimming", "supported", [](Options& options, double) { options.trimming.kind = Trimming::supported; });
  return result;
}

std::string idOf(const Variation& variation)
{
  return variation.value.empty() ? variation.option
                                 : variation.option.substr(0, variation.option.find(',')) + "=" + variation.value;
}

} // namespace

Section defaults(Laboratory& laboratory)
{
  const bool isQuick = laboratory.options().quick;
  const int scansPerObject = isQuick ? 1 : 2;
  std::vector<ScanObject> objects = scanObjects(laboratory.options());
  if (isQuick)
    objects = {objects.front()};
  const std::vector<Variation> all = variations();
  std::vector<PatchResults> results(all.size());
  std::vector<std::vector<Pair>> pairs(all.size());
  int group = 0;
  for (const ScanObject& object : objects)
    for (int index = 0; index < scansPerObject; ++index, ++group) {
      const PatchScan patchScan{object, index};
      Lazy<Scan> scan([&] { return simulate(patchScan, laboratory); });
      json byDefault;
      for (std::size_t v = 0; v < all.size(); ++v) {
        const Method method = ours(idOf(all[v]), idOf(all[v]), all[v].change);
        const json measured = laboratory.measure("defaults" + samplingSuffix(laboratory.options()) + "/" + object.id +
                                                     "/" + std::to_string(index) + "/" + method.id,
                                                 [&] { return measurePatches(method, patchScan, scan(), laboratory); });
        results[v].add(measured);
        if (v == 0)
          byDefault = measured;
        addPairs(measured, byDefault, group, pairs[v]);
      }
    }

  Table table{"defaults", "One option at a time: errors in % of the diagonal", {"option", "value"}, {}};
  for (const std::string& column : patchColumns())
    table.columns.push_back(column);
  for (const char* column : {"hole by hole: median of its error / default's", "95 % from", "to"})
    table.columns.emplace_back(column);
  for (std::size_t v = 0; v < all.size(); ++v) {
    std::vector<json> row = {all[v].option, all[v].value};
    for (const json& cell : patchCells(results[v]))
      row.push_back(cell);
    const Comparison comparison = compare(pairs[v], 1);
    for (const double value : {comparison.medianRatio, comparison.lower, comparison.upper})
      row.push_back(comparison.pairs > 0 ? json(rounded(value)) : json());
    table.rows.push_back(row);
  }

  Section section{"defaults", "Deciding the defaults", {}, {}, {}, {}};
  section.paragraphs = {
      "The scans of Table 1, " + std::to_string(scansPerObject) + " of each of " + std::to_string(objects.size()) +
          (objects.size() == 1 ? " object, " : " objects, ") + samplingTitle(laboratory.options()) +
          ": what changes if one option is not at its default. Ratios are taken hole by hole, with a bootstrap "
          "interval over scans.",
      "beta and dEmax act on voxel-wise observations, so these rows are of the estimate plane; what they change is to "
      "be read beside its own row. A row that repeats a default has a ratio of 1, apart from lengths: automatic ones "
      "follow the spacing of the points that are left or the data themselves, those of the table the spacing before "
      "patches were left out.",
      "A patch can cut the end of a limb off the rest. The least component is the share of the points below which such "
      "a part is dropped as noise; what is dropped counts in the accuracy."};
  if (isQuick)
    section.paragraphs.push_back("Quick: one object, one scan, fewer points.");
  section.tables = {table};
  return section;
}

} // namespace mrf_apps

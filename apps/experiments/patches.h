// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Leaving patches out: scans with holes, how well each hole is filled, and methods compared hole by hole.
#pragma once

#include "methods.h"
#include "objects.h"

#include <cstdint>
#include <string>
#include <vector>

namespace mrf_apps {

/// The hole that each point was taken by: the one in whose ball it lies, the deepest if the balls overlap. −1: none.
std::vector<std::int32_t> holesOf(const std::vector<Eigen::Vector3d>& points,
                                  const std::vector<pcl::mrf::scan::Hole>& holes);

/// Root mean square per hole; NaN for holes with fewer than `minPoints`, which say little.
std::vector<double> rmsPerHole(const std::vector<double>& distances, const std::vector<std::int32_t>& holes,
                               std::size_t count, std::size_t minPoints);

/// Errors of the same holes by two methods. Holes of one scan belong to one group: they share what went wrong in it.
struct Pair {
  double a, b; ///< > 0
  int group;
};

/// Adds the holes of one scan where both methods were measured. \param a, b as measureSurface gives them, or failures
void addPairs(const nlohmann::json& a, const nlohmann::json& b, int group, std::vector<Pair>& pairs);

struct Comparison {
  std::size_t pairs = 0;
  double shareBelow = 0;       ///< of the pairs in which a is below b
  double medianRatio = 0;      ///< of a / b
  double lower = 0, upper = 0; ///< of the median ratio: 95 % interval by resampling groups
};

/// The percentile bootstrap with 2,000 resamples. All zero for no pairs.
Comparison compare(const std::vector<Pair>& pairs, std::uint64_t seed);

/// A scan with patches left out.
struct PatchScan {
  ScanObject object;
  int index;
};

/// Of Table 1: all (quick: the first and the last).
std::vector<ScanObject> patchObjects(const ExperimentOptions& options);

/// The same for how often each is scanned.
inline int scansPerObject(const ExperimentOptions& options)
{
  return options.quick ? 1 : 6;
}

/// Every scan of an experiment: 12 views with occlusion, about 28,000 points (quick: 8,000) in the options' sampling,
/// holes at random places with radii of 4 to 10 % of the diagonal. The same scans for every experiment that asks for as
/// many of them. Its spacing is that of evenly spread points of the same density, whatever the sampling, so that
/// options which are lengths mean the same.
pcl::mrf::scan::Scan simulate(const PatchScan& scan, Laboratory& laboratory);

/// What sets results and files of the options' sampling apart: "" for even scans, else "-random" or "-scanner".
std::string samplingSuffix(const ExperimentOptions& options);

/// The same in words for the page, "even sampling".
std::string samplingTitle(const ExperimentOptions& options);

/// Of simulate().
constexpr int holesPerScan = 5;

/// Measures a surface against the scan it was made from; lengths in % of the object's diagonal: RMS distance of the
/// points where they truly are, without noise, to the surface ("accuracy"), of each hole's held-out points ("holes",
/// null where too few), of the surface to the object ("reference"), share of the mesh's area farther than 1 % from the
/// object ("invented", in %), components, boundary loops, "flaws" (non-manifold edges and vertices, degenerate
/// triangles).
nlohmann::json measureSurface(const SurfaceMesh& mesh, const LoadedObject& object, const pcl::mrf::scan::Scan& scan,
                              pcl::mrf::Execution& execution);

/// Measures a method on a scan: what measureSurface gives, and "processorSeconds".
nlohmann::json measurePatches(const Method& method, const PatchScan& patchScan, const pcl::mrf::scan::Scan& scan,
                              Laboratory& laboratory);

/// Results of one method on some scans.
struct PatchResults {
  std::vector<double> holes, accuracies, invented, processor; ///< per hole, per scan
  int scans = 0, failures = 0, severalComponents = 0, flawed = 0;

  void add(const nlohmann::json& measured);
};

/// Columns and cells of PatchResults for tables.
std::vector<std::string> patchColumns();
std::vector<nlohmann::json> patchCells(const PatchResults& results);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Noisy scans without normals: methods on them, and how near the true surface they stay.
#pragma once

#include "methods.h"
#include "objects.h"

#include <functional>
#include <string>
#include <vector>

namespace mrf_apps {

/// Of every scan here: 28,000 points (quick: 6,000) from 12 views, the seed of the options.
pcl::mrf::scan::ScanOptions baseScan(const ExperimentOptions& options);

/// Up to four objects of one component each (quick: one), real head scans first.
std::vector<ScanObject> noisyObjects(const ExperimentOptions& options);

/// Scans of them with noise of .25 % of the diagonal, 1 % outliers and holes of 4 to 10 % of the diagonal.
pcl::mrf::scan::ScanOptions noisyScan(const ExperimentOptions& options, int index);

constexpr int holesOfNoisyScan = 6;

struct NoisyResult {
  SurfaceMesh mesh;
  double smoothing = 0; ///< ℓ that was used, cloud's unit; 0: unknown to the method
  double noise = 0;     ///< deviation that the method found, cloud's unit; 0: it looked for none
};

struct NoisyMethod {
  std::string id, title;
  /// \throw pcl::mrf::Error if there is no surface
  std::function<NoisyResult(const pcl::mrf::scan::Scan&, pcl::mrf::Execution&)> run;
};

/// Ours: normals are estimated and face the sensors, outliers are dropped. Not remeshed.
NoisyMethod oursOnNoise(const std::string& id, const std::string& title, const Change& change);

/// The default options.
NoisyMethod defaultOnNoise();

/// Voxel-wise observations with the prior of the paper's figures, k = 2.
NoisyMethod voxelwiseOnNoise(pcl::mrf::ObservationKind kind, double beta);

/// Another method on all points of the scan, with normals as withEstimatedNormals gives them.
NoisyMethod peerOnNoise(const Method& method);

/// Another method on what the first stage of ours leaves: points without outliers, consistent normals.
NoisyMethod peerOnOurPoints(const Method& method);

/// What a method gets that cannot do without normals: those of the planes fitted to the points' neighbors, facing the
/// sensor that saw the point.
pcl::mrf::scan::Points withEstimatedNormals(const pcl::mrf::scan::Scan& scan, pcl::mrf::Execution& execution);

/// Measures a method on a scan: what measureSurface gives, and in mean spacings the smoothing length and the noise that
/// the method found ("smoothing", "noise"; null: unknown), and "processorSeconds".
nlohmann::json measureNoisy(const NoisyMethod& method, const LoadedObject& object, const pcl::mrf::scan::Scan& scan,
                            pcl::mrf::Execution& execution);

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// Measures a reconstructed mesh: distances to measured points and to the true surface, validity, triangle shapes.
#pragma once

#include "support/surface_mesh.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mrf_apps {

/// Statistics of distances or of angles.
struct Statistics {
  std::int64_t count = 0;
  double rms = 0, mean = 0, median = 0, percentile95 = 0, max = 0;
};

/// Quantiles between two values are interpolated linearly. All zero for no values.
Statistics summarize(std::vector<double> values);

/// The finite points.
std::vector<Eigen::Vector3d> finite(const std::vector<Eigen::Vector3d>& points);

/// The data to compare the mesh with; empty members are skipped.
struct EvaluationInput {
  std::vector<Eigen::Vector3d> cloud; ///< the points that were reconstructed
  /// One per point, of any length; empty: the cloud has none. A normal that is zero or not finite is skipped.
  std::vector<Eigen::Vector3f> cloudNormals;
  std::vector<Eigen::Vector3d> heldOut; ///< withheld from the reconstruction, to measure how holes were filled
  std::vector<Eigen::Vector3d> clean;   ///< the cloud without its noise
  std::optional<SurfaceMesh> reference; ///< the true surface
};

/// The command line checks the ranges of the options.
struct EvaluationOptions {
  /// The length that is 100 %, cloud's unit, ≥ 0; 0: the diagonal of the bounding box of the reference's surface, else
  /// of the cloud, else of the mesh.
  double diagonal = 0;
  double farLimit = 0;  ///< surface farther from the other is invented or missing, ≥ 0; 0: 1 % of the diagonal
  double farGrowth = 0; ///< of the limit with the square of the depth from a sensor, 1 / cloud's unit, ≥ 0
  std::vector<Eigen::Vector3d> sensors;                 ///< that looked at the reference; none: no SensorComparison
  Eigen::Vector3d sensorAxis = Eigen::Vector3d::Zero(); ///< direction of all cameras; zero: sensors look all around
  std::int64_t samples = 200000;                        ///< number on the mesh, and on the reference, 1..10⁸
  std::uint64_t seed = 1;                               ///< of the samples
};

/// Compares the mesh with the true surface, by samples that stand for the same area each.
struct ReferenceComparison {
  Statistics meshToReference, referenceToMesh;
  double hausdorff = 0;        ///< larger of both directions, over samples and vertices: a nearly sharp lower bound
  double hausdorffPercent = 0; ///< of the diagonal
  double inventedShare = 0;    ///< of the mesh's area that is farther than the limit from the reference
  double missingShare = 0;     ///< of the reference's area that is farther than the limit from the mesh
  /// Angles between the mesh's triangles and the closest triangles of the reference, degrees 0..180, where the mesh is
  /// not invented. The normals are those of triangles, not interpolated: nothing is assumed about shared vertices.
  Statistics normalDeviation;
  double flippedShare = 0; ///< share of the samples of normalDeviation above 90°
  double areaRatio = 0;    ///< the mesh's area that is not invented over the reference's that is not missing
};

/// Compares the mesh with the true surface where sensors saw it, near the noise-free cloud if there is one. The mesh is
/// there if its depth is within farLimit + farGrowth · depth² of the true depth. Depth is along the line of sight, or
/// along the axis of a camera. True normals are interpolated between those of the reference's vertices if it has any.
struct SensorComparison {
  static constexpr double scannedLimit = 2; ///< from the noise-free cloud, local spacings: the distance of its rows

  /// Shares of the view: of the pixels of a camera, else of the solid angle.
  double missingShare = 0, inFrontShare = 0;
  double rms = 0;               ///< of the depth where the mesh is there, cloud's unit
  double rmsPercent = 0;        ///< of the diagonal
  double rmsInLimits = 0;       ///< of the error of the depth divided by the limit
  double medianNormalError = 0; ///< over the area of the mesh at the truth, degrees
  double flippedShare = 0;      ///< of that area where the normal is more than 90° off
  double areaRatio = 0;         ///< that area over the true area where the mesh is there: 1 if equally smooth
  double inFrontAreaShare = 0;  ///< of the whole mesh's area
};

/// Traces rays from the sensors to samples of the reference that they see, and to samples of the mesh.
/// \param measured points of the reference: surface farther from them than scannedLimit was not scanned; empty: all
/// visible surface was scanned \param options with sensors, and with automatic values replaced \throw
/// pcl::mrf::InvalidInput if no sensor sees any of the reference
/// Cost: three rays per sample and sensor. The result does not depend on the number of threads.
SensorComparison compareFromSensors(const SurfaceMesh& mesh, const SurfaceMesh& reference,
                                    const std::vector<Eigen::Vector3d>& measured, const EvaluationOptions& options,
                                    pcl::mrf::Execution& execution);

/// Compares the mesh with the cloud that it was made from, in local spacings of the cloud: the local spacing of a point
/// is .313 times its distance to its 8th neighbor in the cloud (see LocalSpacing). So a wall sampled ten times as
/// coarsely as the cup in front of it may be off by ten times as much.
struct LocalComparison {
  static constexpr double nearLimit = 5;      ///< a point farther from the mesh has no surface, local spacings
  static constexpr double inventedLimit = 10; ///< surface farther from the cloud has no points, local spacings

  double spacing = 0;               ///< median over the cloud, cloud's unit
  double unevenness = 0;            ///< 90th over 10th percentile of the spacings
  double cloudRms = 0;              ///< from the cloud to the mesh, in median spacings
  std::optional<double> heldOutRms; ///< from the held-out points to the mesh, in median spacings
  double nearShare = 0;             ///< of the cloud's points that are within nearLimit of their spacings of the mesh
  double inventedShare = 0; ///< of the mesh's area that is farther than inventedLimit spacings from the nearest point
  std::optional<double> flippedShare; ///< of the cloud's normals that oppose the nearest triangle's
};

struct Evaluation {
  EvaluationOptions options;            ///< with the automatic values replaced
  std::string diagonalSource = "given"; ///< or "reference", "input cloud", "mesh"

  /// Exact distances from the points to the mesh (the paper's Sec. 4): `rms` of the cloud is the accuracy, that of the
  /// held-out points the error of filled holes.
  std::optional<Statistics> cloud, heldOut, clean;
  std::int64_t pointsNotFinite = 0; ///< in all clouds; these are left out
  std::optional<ReferenceComparison> reference;
  std::optional<SensorComparison> sensor; ///< with a reference and sensors
  /// Needs a cloud of at least nine distinct points.
  std::optional<LocalComparison> local;

  pcl::mrf::MeshStatistics mesh;
  std::int64_t selfIntersectingTriangles = 0; ///< exact, by CGAL; degenerate triangles are counted in `mesh`, not here
  /// Triangles by area / mean area, in steps of areaStep; the last bin collects the larger ones.
  std::array<std::int64_t, 25> areas{};
  static constexpr double areaStep = .1;

  /// Variance of the triangles' areas relative to the square of their mean: 0 for triangles of one size.
  double areaVariance() const { return mesh.areaDeviation * mesh.areaDeviation; }
};

/// Measures the mesh.
/// \throw pcl::mrf::InvalidInput if mesh or reference has no triangle with an area, or a diagonal is zero
/// Cost: O(log n) per point and sample. The result does not depend on the number of threads.
Evaluation evaluate(const SurfaceMesh& mesh, const EvaluationInput& input, const EvaluationOptions& options,
                    pcl::mrf::Execution& execution);

/// The error at each vertex, cloud's unit: the distance to the reference's surface, else to the nearest point that is
/// known to lie on the surface: held-out and noise-free points, or those of the cloud where there is no noise-free one.
/// NaN at vertices that are not finite.
/// \throw pcl::mrf::InvalidInput if nothing is there to compare with
std::vector<float> vertexErrors(const SurfaceMesh& mesh, const EvaluationInput& input, pcl::mrf::Execution& execution);

/// The whole evaluation, under the names of its members. Statistics of distances come twice: in the cloud's unit, and
/// in per cent of the diagonal under the same name with `Percent` appended. Shares are 0..1. Figures that were not
/// measured are left out.
nlohmann::ordered_json toJson(const Evaluation& evaluation);

/// The same as text: a line per figure, a row per statistics; histograms are left out.
std::string toText(const nlohmann::ordered_json& json, const std::string& indent = {});

} // namespace mrf_apps

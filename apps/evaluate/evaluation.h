// SPDX-License-Identifier: BSD-3-Clause
/// How good a reconstructed mesh is: distances to what was measured and to the truth, validity, triangle shapes.
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

/// Of a set of distances, or of angles.
struct Statistics {
  std::int64_t count = 0;
  double rms = 0, mean = 0, median = 0, percentile95 = 0, max = 0;
};

/// Quantiles between two values are interpolated linearly. All zero for no values.
Statistics summarize(std::vector<double> values);

/// Those of the points that are finite.
std::vector<Eigen::Vector3d> finite(const std::vector<Eigen::Vector3d>& points);

/// What the mesh is measured against; whatever is empty is not measured.
struct EvaluationInput {
  std::vector<Eigen::Vector3d> cloud; ///< that was reconstructed
  /// As many as points, need not be unit; empty: it has none. One that is zero or not finite is none.
  std::vector<Eigen::Vector3f> cloudNormals;
  std::vector<Eigen::Vector3d> heldOut; ///< kept from the reconstruction to judge how holes were filled
  std::vector<Eigen::Vector3d> clean;   ///< the cloud without its noise
  std::optional<SurfaceMesh> reference; ///< the true surface
};

/// The command line checks the ranges.
struct EvaluationOptions {
  /// That percentages refer to, cloud's unit, ≥ 0; 0 = of the bounding box of the reference's surface, else of the
  /// cloud, else of the mesh.
  double diagonal = 0;
  double farLimit = 0;  ///< surface farther from the other is invented or missing, ≥ 0; 0 = 1 % of the diagonal
  double farGrowth = 0; ///< of the limit from the sensors, with the square of the depth, 1 / cloud's unit, ≥ 0
  std::vector<Eigen::Vector3d> sensors; ///< that looked at the reference; none: SensorComparison is not made
  Eigen::Vector3d sensorAxis = Eigen::Vector3d::Zero(); ///< where all of them look, a camera's; zero: all around
  std::int64_t samples = 200000;                        ///< on the mesh, and on the reference, 1..10⁸
  std::uint64_t seed = 1;                               ///< of the samples
};

enum class DiagonalSource { option, reference, cloud, mesh };

/// The mesh beside the true surface; over samples that stand for the same area each.
struct ReferenceComparison {
  Statistics meshToReference, referenceToMesh;
  double hausdorff = 0; ///< the larger of both ways, over the samples and all vertices: a lower bound, nearly sharp
  double hausdorffPercent = 0; ///< of the diagonal
  double inventedShare = 0;    ///< of the mesh's area, farther than the limit from the reference
  double missingShare = 0;     ///< of the reference's area, farther than the limit from the mesh
  /// Angles between the mesh's triangles and the reference's closest ones, degrees 0..180, where the mesh is not
  /// invented. Of triangles, not of interpolated normals: nothing is assumed about shared vertices.
  Statistics normalDeviation;
  double flippedShare = 0; ///< of the samples behind normalDeviation, those above 90°
  double areaRatio = 0;    ///< the mesh's area that is not invented over the reference's that is not missing
};

/// The mesh beside the true surface where sensors saw that, near the noise-free cloud if there is one. Surface is there
/// if it is within the limit, farLimit + farGrowth · depth², of the truth, in depth: along the line of sight, or along
/// the axis of a camera. Normals of the truth are interpolated between those of the reference's vertices if it has any.
struct SensorComparison {
  static constexpr double scannedLimit = 2; ///< of the noise-free cloud, local spacings: the distance of its rows

  /// Shares of the view: of the pixels of a camera, else of the solid angle.
  double missingShare = 0, inFrontShare = 0;
  double rms = 0;               ///< of the depth where the mesh is there, cloud's unit
  double rmsPercent = 0;        ///< of the diagonal
  double rmsInLimits = 0;       ///< likewise, over the limit
  double medianNormalError = 0; ///< over the area of the mesh at the truth, degrees
  double flippedShare = 0;      ///< of that area, more than 90° off
  double areaRatio = 0;         ///< that area over the truth's where the mesh is there: 1 if it is as smooth
  double inFrontAreaShare = 0;  ///< of the whole mesh's area
};

/// By rays from the sensors to samples of what they see of the reference, and to samples of the mesh.
/// \param measured points of the reference: what is farther from them than SensorComparison::scannedLimit of their
/// spacings was not looked at; empty: all was that can be seen \param options with sensors, and no automatic values
/// left \throw pcl::mrf::InvalidInput if no sensor sees any of the reference Cost: three rays per sample and sensor.
/// The result does not depend on the number of threads.
SensorComparison compareFromSensors(const SurfaceMesh& mesh, const SurfaceMesh& reference,
                                    const std::vector<Eigen::Vector3d>& measured, const EvaluationOptions& options,
                                    pcl::mrf::Execution& execution);

/// The mesh beside the cloud that it was made from, by the cloud's own measure: the local spacing of a point is .313
/// times its distance to its 8th neighbor in the cloud (see LocalSpacing). A wall that is sampled ten times as coarsely
/// as the cup before it may be ten times as far away.
struct LocalComparison {
  static constexpr double nearLimit = 5;      ///< a point farther from the mesh has no surface, local spacings
  static constexpr double inventedLimit = 10; ///< surface farther from the cloud has no points, local spacings

  double spacing = 0;               ///< median over the cloud, cloud's unit
  double unevenness = 0;            ///< 90th over 10th percentile of the spacings
  double cloudRms = 0;              ///< from the cloud to the mesh, in median spacings
  std::optional<double> heldOutRms; ///< from the held-out points to the mesh, in median spacings
  double nearShare = 0;             ///< of the cloud's points, those within nearLimit of their own spacing of the mesh
  double inventedShare = 0; ///< of the mesh's area, beyond inventedLimit spacings of the nearest point from that point
  std::optional<double> flippedShare; ///< of the cloud's normals, those against the nearest triangle's
};

struct Evaluation {
  EvaluationOptions options; ///< with the automatic values replaced
  DiagonalSource diagonalSource = DiagonalSource::option;

  /// Exact distances from the points to the mesh (the paper's Sec. 4): `rms` of the cloud is its accuracy, of the
  /// held-out points its error of filling holes.
  std::optional<Statistics> cloud, heldOut, clean;
  std::int64_t pointsNotFinite = 0; ///< in all clouds; left out
  std::optional<ReferenceComparison> reference;
  std::optional<SensorComparison> sensor; ///< with a reference and sensors
  /// None without a cloud of at least nine distinct points.
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

/// Everything in the evaluation, under the names of its members. Statistics of distances come twice: in the cloud's
/// unit, and in per cent of the diagonal under the same name with `Percent` appended. Shares are 0..1. What was not
/// measured is not there.
nlohmann::ordered_json toJson(const Evaluation& evaluation);

/// The same to be read: a line per figure, a row per statistics; histograms are left out.
std::string toText(const nlohmann::ordered_json& json, const std::string& indent = {});

} // namespace mrf_apps

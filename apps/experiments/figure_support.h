// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief What the figures share: objects, reconstructions, colors, numbers for tables.
#pragma once

#include "experiment.h"

#include "evaluate/evaluation.h"
#include "scan/scan.h"

#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/reconstruction.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace mrf_apps {
namespace figures {

using Places = std::vector<Eigen::Vector3d>;
using Color = std::array<std::uint8_t, 3>;

/// Computes a value when it is first asked for: what was measured by an earlier run needs no reconstruction, unless a
/// picture of it is missing.
template <typename Value>
class Lazy {
public:
  explicit Lazy(std::function<Value()> compute) : compute_(std::move(compute)) {}
  const Value& operator()()
  {
    if (!value_)
      value_ = compute_();
    return *value_;
  }

private:
  std::function<Value()> compute_;
  std::optional<Value> value_;
};

/// Where that package puts its bunny.
constexpr const char* bunnyFile = "/usr/share/glmark2/models/bunny.obj";

/// The Stanford bunny of Debian's glmark2-data; none where that is not installed.
std::optional<SurfaceMesh> bunny();

/// Runs all stages. \param normals empty: they are estimated
pcl::mrf::Reconstruction reconstruct(const Places& positions, const Places& normals, const pcl::mrf::Options& options,
                                     pcl::mrf::Execution& execution);

/// What a scanner delivers, for the library: normals are left out.
pcl::mrf::RawCloud withoutNormals(const pcl::mrf::scan::Scan& scan);

/// Runs all stages on what a scanner delivers. \param hasNormals false: they are estimated, and face the sensor that
/// saw their point
pcl::mrf::Reconstruction reconstruct(const pcl::mrf::scan::Scan& scan, bool hasNormals,
                                     const pcl::mrf::Options& options, pcl::mrf::Execution& execution);

/// Single precision, as the library takes points.
std::vector<Eigen::Vector3f> toFloat(const Places& places);

/// The mesh in the cloud's frame, with its fields.
using mrf_apps::toSurfaceMesh;
SurfaceMesh toSurfaceMesh(const pcl::mrf::Reconstruction& reconstruction);

/// Distance to the nearest of the points for each place.
std::vector<double> distancesToPoints(const Places& places, const Places& points, pcl::mrf::Execution& execution);

/// A small disc across the normal of each point that faces a viewer in the direction `from`.
SurfaceMesh facingDiscs(const pcl::mrf::scan::Points& points, const Eigen::Vector3d& from, double radius);

/// Colors of confidences 0..1 and their bar.
void colorByConfidence(SurfaceMesh& mesh);
Legend confidenceLegend();

/// Light to dark from 0 to the largest error that is told apart, which larger ones share.
Color errorColor(double error, double largest);
Legend errorLegend(const std::string& title, double largest);

/// Where points support the surface it has one color; the rest shows its distance to the truth. Lengths in % of the
/// scan's diagonal.
/// \param errors of the vertices, cloud's unit
void colorFillings(const pcl::mrf::scan::Scan& scan, const std::vector<double>& errors, double largestPercent,
                   SurfaceMesh& mesh, pcl::mrf::Execution& execution);

const char* nameOf(pcl::mrf::Prior prior);
constexpr pcl::mrf::Prior allPriors[] = {pcl::mrf::Prior::membrane, pcl::mrf::Prior::thinPlate,
                                         pcl::mrf::Prior::triharmonic};

/// A plot without curves.
Plot emptyPlot(Plot::Kind kind, const std::string& name, const std::string& title, const std::string& xLabel,
               const std::string& yLabel);

/// To a number of significant digits, so that tables stay readable and do not show the last bits of a sum.
double rounded(double value, int digits = 3);
/// The same as text.
std::string text(double value, int digits = 3);

} // namespace figures
} // namespace mrf_apps

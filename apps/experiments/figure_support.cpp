// SPDX-License-Identifier: BSD-3-Clause
#include "figure_support.h"

#include "support/mesh_reader.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

namespace mrf_apps {
namespace figures {

using pcl::mrf::Execution;

namespace {

/// Of a bar of colors.
constexpr int legendSteps = 32;

} // namespace

std::optional<SurfaceMesh> bunny()
{
  if (!std::filesystem::exists(bunnyFile))
    return std::nullopt;
  return readMesh(bunnyFile);
}

std::vector<Eigen::Vector3f> toFloat(const Places& places)
{
  std::vector<Eigen::Vector3f> result;
  result.reserve(places.size());
  for (const Eigen::Vector3d& place : places)
    result.push_back(place.cast<float>());
  return result;
}

pcl::mrf::Reconstruction reconstruct(const Places& positions, const Places& normals, const pcl::mrf::Options& options,
                                     Execution& execution)
{
  pcl::mrf::RawCloud cloud;
  cloud.positions = toFloat(positions);
  cloud.normals = toFloat(normals);
  return pcl::mrf::reconstruct(std::move(cloud), options, execution);
}

pcl::mrf::RawCloud withoutNormals(const pcl::mrf::scan::Scan& scan)
{
  pcl::mrf::RawCloud cloud;
  cloud.positions = toFloat(scan.cloud.positions);
  cloud.views = scan.cloud.views;
  cloud.sensors = scan.sensors;
  return cloud;
}

pcl::mrf::Reconstruction reconstruct(const pcl::mrf::scan::Scan& scan, bool hasNormals,
                                     const pcl::mrf::Options& options, Execution& execution)
{
  return hasNormals ? reconstruct(scan.cloud.positions, scan.cloud.normals, options, execution)
                    : pcl::mrf::reconstruct(withoutNormals(scan), options, execution);
}

SurfaceMesh toSurfaceMesh(const pcl::mrf::Reconstruction& reconstruction)
{
  return toSurfaceMesh(reconstruction.mesh, reconstruction.points.offset);
}

std::vector<double> distancesToPoints(const Places& places, const Places& points, Execution& execution)
{
  const Eigen::Vector3d& origin = points.front();
  const auto local = [&](const Eigen::Vector3d& place) { return Eigen::Vector3f((place - origin).cast<float>()); };
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(points.size());
  for (const Eigen::Vector3d& point : points)
    positions.push_back(local(point));
  const auto search = pcl::mrf::makePointBins();
  search->setPoints(positions);
  std::vector<double> distances(places.size());
  execution.forRange(static_cast<std::int64_t>(places.size()), 1024, [&](std::int64_t begin, std::int64_t end) {
    pcl::mrf::Neighbors nearest;
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      search->nearest(local(places[i]), 1, nearest);
      distances[i] = std::sqrt(nearest.squaredDistances.front());
    }
  });
  return distances;
}

SurfaceMesh facingDiscs(const pcl::mrf::scan::Points& points, const Eigen::Vector3d& from, double radius)
{
  constexpr std::int32_t corners = 6;
  SurfaceMesh mesh;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d& normal = points.normals[i];
    if (normal.dot(from) <= 0)
      continue;
    const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    const auto first = static_cast<std::int32_t>(mesh.vertices.size());
    for (std::int32_t corner = 0; corner < corners; ++corner) {
      const double angle = 2 * M_PI * corner / corners;
      mesh.vertices.emplace_back(points.positions[i] + radius * (std::cos(angle) * u + std::sin(angle) * v));
      mesh.normals.emplace_back(normal.cast<float>());
      if (corner >= 2)
        mesh.triangles.push_back({first, first + corner - 1, first + corner});
    }
  }
  return mesh;
}

void colorByConfidence(SurfaceMesh& mesh)
{
  mesh.colors.clear();
  mesh.colors.reserve(mesh.confidences.size());
  for (const float confidence : mesh.confidences)
    mesh.colors.push_back(pcl::mrf::confidenceColor(confidence));
}

Legend confidenceLegend()
{
  Legend legend{"confidence", 0, 1, {}};
  for (int i = 0; i <= legendSteps; ++i)
    legend.colors.push_back(pcl::mrf::confidenceColor(static_cast<float>(i) / legendSteps));
  return legend;
}

Color errorColor(double error, double largest)
{
  constexpr std::array<Color, 5> colors = {
      {{118, 190, 196}, {232, 226, 166}, {240, 166, 92}, {205, 76, 60}, {118, 18, 48}}};
  const double position = std::clamp(error / largest, 0., 1.) * static_cast<double>(colors.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(position), colors.size() - 2);
  Color color{};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const double a = colors[below][channel], b = colors[below + 1][channel];
    color[channel] = static_cast<std::uint8_t>(std::lround(a + (position - static_cast<double>(below)) * (b - a)));
  }
  return color;
}

Legend errorLegend(const std::string& title, double largest)
{
  Legend legend{title, 0, largest, {}};
  for (int i = 0; i <= legendSteps; ++i)
    legend.colors.push_back(errorColor(i, legendSteps));
  return legend;
}

void colorFillings(const pcl::mrf::scan::Scan& scan, const std::vector<double>& errors, double largestPercent,
                   SurfaceMesh& mesh, Execution& execution)
{
  constexpr Color supported{204, 199, 189};
  const std::vector<double> toPoints = distancesToPoints(mesh.vertices, scan.cloud.positions, execution);
  mesh.colors.clear();
  mesh.colors.reserve(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.colors.push_back(toPoints[v] < 3 * scan.spacing ? supported
                                                         : errorColor(errors[v], largestPercent / 100 * scan.diagonal));
}

const char* nameOf(pcl::mrf::Prior prior)
{
  switch (prior) {
  case pcl::mrf::Prior::membrane:
    return "k = 1, membrane";
  case pcl::mrf::Prior::thinPlate:
    return "k = 2, thin plate";
  case pcl::mrf::Prior::triharmonic:
    return "k = 3, triharmonic";
  }
  return "?";
}

Plot emptyPlot(Plot::Kind kind, const std::string& name, const std::string& title, const std::string& xLabel,
               const std::string& yLabel)
{
  Plot plot;
  plot.kind = kind;
  plot.name = name;
  plot.title = title;
  plot.xLabel = xLabel;
  plot.yLabel = yLabel;
  return plot;
}

double rounded(double value, int digits)
{
  if (value == 0 || !std::isfinite(value))
    return value;
  return std::stod(text(value, digits));
}

std::string text(double value, int digits)
{
  char buffer[40];
  std::snprintf(buffer, sizeof(buffer), "%.*g", digits, value);
  return buffer;
}

} // namespace figures
} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/option_table.h>
#include <pcl/surface/mrf/report.h>

#include <pcl/surface/impl/mrf_reconstruction.hpp>

#include <pcl/console/print.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <tuple>
#include <utility>

namespace pcl::mrf::detail {
namespace {

/// Adds a float32 field to the layout of a cloud.
void addField(PCLPointCloud2& cloud, const char* name)
{
  PCLPointField field;
  field.name = name;
  field.offset = cloud.point_step;
  field.datatype = PCLPointField::FLOAT32;
  field.count = 1;
  cloud.fields.push_back(field);
  cloud.point_step += 4;
}

/// Sorts an answer by distance, equals by index: an octree answers in the order of its cells.
void sort(Neighbors& answer)
{
  const auto entry = [&](std::size_t n) { return std::make_pair(answer.squaredDistances[n], answer.indices[n]); };
  std::size_t ordered = 1;
  while (ordered < answer.indices.size() && entry(ordered - 1) < entry(ordered))
    ++ordered;
  if (ordered >= answer.indices.size())
    return;
  std::vector<std::pair<float, int>> entries;
  for (std::size_t n = 0; n < answer.indices.size(); ++n)
    entries.push_back(entry(n));
  std::sort(entries.begin(), entries.end());
  for (std::size_t n = 0; n < entries.size(); ++n)
    std::tie(answer.squaredDistances[n], answer.indices[n]) = entries[n];
}

[[noreturn]] void failAnswer(const std::string& what)
{
  throw InvalidInput("the object of setSearchMethod answered with " + what);
}

} // namespace

void clear(pcl::PolygonMesh& output, const PCLHeader& header, const VertexFields& fields)
{
  output = pcl::PolygonMesh();
  output.header = header;
  PCLPointCloud2& cloud = output.cloud;
  cloud.header = header;
  cloud.height = 1;
  cloud.is_dense = 1;
  for (const char* name : {"x", "y", "z", "normal_x", "normal_y", "normal_z", "confidence"})
    addField(cloud, name);
  if (fields.rgb)
    addField(cloud, "rgb");
  if (fields.intensity)
    addField(cloud, "intensity");
  if (fields.sigma)
    for (const char* name : {"sigma", "sigma_calibrated"})
      addField(cloud, name);
}

void write(const Reconstruction& result, pcl::PolygonMesh& output)
{
  const TriangleMesh& mesh = result.mesh;
  const std::vector<Rgb> colors = vertexColors(result);
  PCLPointCloud2& cloud = output.cloud;
  cloud.width = static_cast<std::uint32_t>(mesh.vertices.size());
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.data.resize(std::size_t{cloud.point_step} * cloud.width);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Eigen::Vector3f position = (mesh.vertices[v].cast<double>() + result.points.offset).cast<float>();
    const Eigen::Vector3f& normal = mesh.normals[v];
    std::array<float, 11> values = {position.x(), position.y(), position.z(),       normal.x(),
                                    normal.y(),   normal.z(),   mesh.confidences[v]};
    std::size_t next = 7;
    if (!colors.empty()) {
      const std::uint32_t packed = packRgb(colors[v]);
      std::memcpy(&values[next++], &packed, sizeof(packed));
    }
    if (!result.intensities.empty())
      values[next++] = result.intensities[v];
    if (!mesh.sigmas.empty()) {
      values[next++] = mesh.sigmas[v];
      values[next] = static_cast<float>(mesh.calibrated[v]);
    }
    std::memcpy(cloud.data.data() + v * cloud.point_step, values.data(), cloud.point_step);
  }
  write(mesh.triangles, output.polygons);
}

void write(const std::vector<Triangle>& triangles, std::vector<pcl::Vertices>& polygons)
{
  polygons.resize(triangles.size());
  for (std::size_t t = 0; t < polygons.size(); ++t)
    polygons[t].vertices.assign(triangles[t].begin(), triangles[t].end());
}

void log(Report& report) noexcept
{
  try {
    for (std::string& warning : report.warnings) {
      warning = withOptionNames(warning, OptionNaming::setters);
      PCL_WARN("[pcl::MRFReconstruction::reconstruct] %s\n", warning.c_str());
    }
    report.message = withOptionNames(report.message, OptionNaming::setters);
    if (report.status != Status::ok)
      PCL_ERROR("[pcl::MRFReconstruction::reconstruct] %s: %s\n", toString(report.status), report.message.c_str());
  } catch (...) { // PCL's console may lack memory; the report has all messages
  }
}

std::exception_ptr asThrown(const std::exception_ptr& error)
{
  try {
    std::rethrow_exception(error);
  } catch (const CallerError& caught) {
    return caught.nested_ptr();
  } catch (...) {
    return error;
  }
}

int checkedAnswer(int found, int max, std::size_t positions, Neighbors& answer)
{
  if (found < 0 || found > max || static_cast<std::size_t>(found) > answer.indices.size() ||
      static_cast<std::size_t>(found) > answer.squaredDistances.size())
    failAnswer(std::to_string(found) + " neighbors, and holds " + std::to_string(answer.indices.size()));
  answer.indices.resize(found);
  answer.squaredDistances.resize(found);
  for (const auto index : answer.indices)
    if (index < 0 || static_cast<std::size_t>(index) >= positions)
      failAnswer("index " + std::to_string(index) + ", and has " + std::to_string(positions) + " points");
  for (const float distance : answer.squaredDistances)
    if (!(distance >= 0))
      failAnswer("a squared distance of " + std::to_string(distance));
  sort(answer);
  return found;
}

} // namespace pcl::mrf::detail

// SPDX-License-Identifier: BSD-3-Clause
#include "point_writer.h"

#include <base/byte_writer.h>

#include <string>

namespace mrf_apps {
namespace {

std::string repeated(const std::string& word, int times)
{
  std::string result;
  for (int i = 0; i < times; ++i)
    result += " " + word;
  return result;
}

std::string plyHeader(std::size_t count, bool isDouble, bool hasNormals)
{
  std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(count) + "\n";
  for (const char* name : {"x", "y", "z"})
    header += std::string("property ") + (isDouble ? "double " : "float ") + name + "\n";
  if (hasNormals)
    header += "property float nx\nproperty float ny\nproperty float nz\n";
  return header + "end_header\n";
}

std::string pcdHeader(std::size_t count, bool isDouble, bool hasNormals)
{
  const int normals = hasNormals ? 3 : 0;
  const std::string points = std::to_string(count);
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z" +
         std::string(hasNormals ? " normal_x normal_y normal_z" : "") + "\nSIZE" + repeated(isDouble ? "8" : "4", 3) +
         repeated("4", normals) + "\nTYPE" + repeated("F", 3 + normals) + "\nCOUNT" + repeated("1", 3 + normals) +
         "\nWIDTH " + points + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + points + "\nDATA binary\n";
}

} // namespace

const char* const pointOutputExtensions = "ply or pcd";

bool isWritableCloud(const std::string& extension)
{
  return extension == "ply" || extension == "pcd";
}

void writePoints(const PointTable& points, const std::string& path, const std::string& format)
{
  const bool hasNormals = !points.normals.empty();
  const bool isDouble = !floatOffset(points.positions).isZero(0);
  pcl::mrf::ByteWriter file(path);
  file.text(format == "pcd" ? pcdHeader(points.size(), isDouble, hasNormals)
                            : plyHeader(points.size(), isDouble, hasNormals));
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis)
      if (isDouble)
        file.value(points.positions[i][axis]);
      else
        file.value(static_cast<float>(points.positions[i][axis]));
    if (hasNormals)
      for (int axis = 0; axis < 3; ++axis)
        file.value(points.normals[i][axis]);
  }
  file.close();
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "float_offset.h"
#include "point_table.h"

#include <base/byte_writer.h>

#include <string>

namespace mrf_apps {
namespace {

/// Of a file with the coordinates of each point and, if it has any, its normal.
std::string headerOf(const std::string& format, const std::string& count, bool isDouble, bool hasNormals)
{
  const std::string type = isDouble ? "double" : "float", size = isDouble ? "8" : "4";
  std::string ply, names, sizes, types, counts;
  const auto add = [&](const char* name, const char* nameInPcd, const std::string& itsType,
                       const std::string& itsSize) {
    ply += "property " + itsType + " " + name + "\n";
    names += std::string(" ") + nameInPcd;
    sizes += " " + itsSize;
    types += " F";
    counts += " 1";
  };
  for (const char* name : {"x", "y", "z"})
    add(name, name, type, size);
  for (const char* name : {"nx", "ny", "nz"})
    if (hasNormals)
      add(name, (std::string("normal_") + name[1]).c_str(), "float", "4");
  if (format == "ply")
    return "ply\nformat binary_little_endian 1.0\nelement vertex " + count + "\n" + ply + "end_header\n";
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS" + names + "\nSIZE" + sizes + "\nTYPE" +
         types + "\nCOUNT" + counts + "\nWIDTH " + count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + count +
         "\nDATA binary\n";
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
  file.text(headerOf(format, std::to_string(points.size()), isDouble, hasNormals));
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

#include "point_table.h"

#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <Eigen/Geometry>

#include <algorithm>

namespace mrf_apps {

const char* const pointFileExtensions = "pcd, ply, obj, xyz or txt";

PointTable parsePoints(const std::string& type, const std::string& path, const std::string& text)
{
  PointTable table = type == "obj"   ? parseObj(path, text)
                     : type == "pcd" ? readPcd(path, text)
                     : type == "ply" ? readPly(path, text)
                                     : parseXyz(path, text);
  if (table.size() == 0)
    throw FileError(path, "holds no points");
  return table;
}

PointTable readPoints(const std::string& path)
{
  const std::string type = extension(path);
  if (type != "pcd" && type != "ply" && type != "obj" && type != "xyz" && type != "txt")
    throw UsageError("'" + path + "': input files end in " + pointFileExtensions);
  return parsePoints(type, path, readWholeFile(path));
}

Eigen::Vector3d floatOffset(const std::vector<Eigen::Vector3d>& positions)
{
  Eigen::AlignedBox3d box;
  double error = 0;
  for (const Eigen::Vector3d& position : positions)
    if (position.allFinite()) {
      box.extend(position);
      error = std::max(error, (position - position.cast<float>().cast<double>()).lpNorm<Eigen::Infinity>());
    }
  if (box.isEmpty() || error <= 1e-7 * box.diagonal().norm())
    return Eigen::Vector3d::Zero();
  return box.center();
}

} // namespace mrf_apps

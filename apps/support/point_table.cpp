#include "point_table.h"

#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>

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

namespace {

/// The box without the outermost hundredth at either end of each axis, of some thousand points: a few strays far away
/// say nothing about the digits that the others need.
Eigen::AlignedBox3d innerBox(const std::vector<Eigen::Vector3d>& positions)
{
  constexpr std::size_t samples = 5000;
  std::array<std::vector<double>, 3> coordinates;
  const std::size_t step = positions.size() / samples + 1;
  for (std::size_t i = 0; i < positions.size(); i += step)
    if (positions[i].allFinite())
      for (std::size_t axis = 0; axis < 3; ++axis)
        coordinates[axis].push_back(positions[i][static_cast<Eigen::Index>(axis)]);
  Eigen::AlignedBox3d box;
  const std::size_t count = coordinates[0].size();
  if (count == 0)
    return box;
  Eigen::Vector3d lower, upper;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::sort(coordinates[axis].begin(), coordinates[axis].end());
    lower[static_cast<Eigen::Index>(axis)] = coordinates[axis][count / 100];
    upper[static_cast<Eigen::Index>(axis)] = coordinates[axis][count - 1 - count / 100];
  }
  return {lower, upper};
}

} // namespace

Eigen::Vector3d floatOffset(const std::vector<Eigen::Vector3d>& positions)
{
  const Eigen::AlignedBox3d box = innerBox(positions);
  double error = 0;
  for (const Eigen::Vector3d& position : positions)
    if (!box.isEmpty() && box.contains(position))
      error = std::max(error, (position - position.cast<float>().cast<double>()).lpNorm<Eigen::Infinity>());
  if (box.isEmpty() || error <= 1e-7 * box.diagonal().norm())
    return Eigen::Vector3d::Zero();
  return box.center();
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "mesh_tiles.h"

#include "support/errors.h"
#include "support/report_json.h"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <numeric>
#include <utility>

namespace mrf_apps {
namespace {

namespace fs = std::filesystem;

/// Cuts a mesh by the first corners of its triangles.
struct TileCutter {
  const SurfaceMesh& mesh;
  std::size_t largest;
  const std::function<void(const SurfaceMesh&)>& use;
  /// Of the vertices in a tile; −1 between tiles.
  std::vector<std::int32_t> places = std::vector<std::int32_t>(mesh.vertices.size(), -1);

  /// Calls use(tile), tile after tile.
  void operator()()
  {
    std::vector<std::uint32_t> all(mesh.triangles.size());
    std::iota(all.begin(), all.end(), 0U);
    cut(all.begin(), all.end());
  }

private:
  using Iterator = std::vector<std::uint32_t>::iterator;

  void cut(Iterator begin, Iterator end)
  {
    const auto count = static_cast<std::size_t>(end - begin), tiles = (count + largest - 1) / largest;
    if (tiles <= 1) {
      std::sort(begin, end);
      use(extract(begin, end));
      return;
    }
    const auto corner = [this](std::uint32_t triangle) { return mesh.vertices[mesh.triangles[triangle][0]]; };
    Eigen::AlignedBox3d box;
    for (Iterator triangle = begin; triangle != end; ++triangle)
      box.extend(corner(*triangle));
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    const Iterator middle = begin + static_cast<std::ptrdiff_t>(count * (tiles / 2) / tiles);
    std::nth_element(begin, middle, end, [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(corner(a)[axis], a) < std::pair(corner(b)[axis], b);
    });
    cut(begin, middle);
    cut(middle, end);
  }

  SurfaceMesh extract(Iterator begin, Iterator end)
  {
    SurfaceMesh tile;
    tile.doublePrecision = mesh.doublePrecision;
    std::vector<std::int32_t> vertices; // of the mesh
    for (Iterator triangle = begin; triangle != end; ++triangle) {
      tile.triangles.push_back(mesh.triangles[*triangle]);
      for (std::int32_t& vertex : tile.triangles.back()) {
        std::int32_t& place = places[vertex];
        if (place < 0) {
          place = static_cast<std::int32_t>(vertices.size());
          vertices.push_back(vertex);
        }
        vertex = place;
      }
    }
    const auto take = [&](const auto& values, auto& taken) {
      for (std::size_t v = 0; v < vertices.size() && !values.empty(); ++v)
        taken.push_back(values[vertices[v]]);
    };
    take(mesh.vertices, tile.vertices);
    take(mesh.normals, tile.normals);
    take(mesh.confidences, tile.confidences);
    take(mesh.colors, tile.colors);
    take(mesh.intensities, tile.intensities);
    for (const auto& [name, values] : mesh.scalars)
      take(values, tile.scalars[name]);
    for (const std::int32_t vertex : vertices)
      places[vertex] = -1;
    return tile;
  }
};

/// An entry of the index. The box is that of the coordinates in the file.
nlohmann::ordered_json entryOf(const SurfaceMesh& tile, const std::string& file)
{
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& vertex : tile.vertices)
    box.extend(tile.doublePrecision ? vertex : Eigen::Vector3d(vertex.cast<float>().cast<double>()));
  return {{"file", fs::path(file).filename().string()},
          {"vertices", tile.vertices.size()},
          {"triangles", tile.triangles.size()},
          {"lower", {box.min().x(), box.min().y(), box.min().z()}},
          {"upper", {box.max().x(), box.max().y(), box.max().z()}}};
}

} // namespace

TileFolder::TileFolder(const std::string& path, const std::vector<std::string>& others) : path_(path), isNew_(false)
{
  if (path.empty())
    return;
  std::error_code error;
  const auto folderOf = [&error](const fs::path& file) { return fs::weakly_canonical(file, error).parent_path(); };
  for (const std::string& other : others)
    if (!other.empty() && folderOf(fs::absolute(other)) == folderOf(fs::absolute(file(0))))
      throw UsageError("'" + other + "' is in the folder of tiles; name another folder for it");
  isNew_ = !fs::exists(path, error);
  makeFolder(path);
  for (const fs::directory_entry& entry : fs::directory_iterator(path, error))
    if (entry.path().filename().string().rfind(".tile_", 0) == 0)
      fs::remove(entry.path(), error); // left by a run that was killed
  if (!fs::is_empty(path, error))
    throw FileError(path, error ? "cannot be read: " + error.message()
                                : "holds files, of an earlier run maybe; delete them, or name another folder");
}

TileFolder::~TileFolder()
{
  std::error_code ignored; // such as that it is not empty
  if (isNew_)
    fs::remove(path_, ignored);
}

std::string TileFolder::file(std::size_t number) const
{
  std::array<char, 40> name;
  std::snprintf(name.data(), name.size(), "tile_%04zu.ply", number);
  return (fs::path(path_) / name.data()).string();
}

std::pair<std::string, std::int64_t> TileFolder::write(const SurfaceMesh& mesh, std::size_t largest,
                                                       OutputFiles& outputs) const
{
  std::int64_t bytes = 0;
  nlohmann::ordered_json tiles = nlohmann::ordered_json::array();
  const auto writeTile = [&](const SurfaceMesh& tile) {
    const std::string path = file(tiles.size());
    if (!tiles.empty())
      outputs.add(path);
    bytes += outputs.write(path, [&](const std::string& temporary) { writeMesh(tile, temporary, "ply"); });
    tiles.push_back(entryOf(tile, path));
  };
  TileCutter{mesh, largest, writeTile}();
  const std::string index = (fs::path(path_) / "index.json").string();
  outputs.add(index);
  bytes += outputs.write(index, [&](const std::string& temporary) {
    writeJson(temporary, {{"tool", "pcl_mrf_reconstruction"}, {"version", MRF_VERSION}, {"tiles", tiles}});
  });
  return {path_ + ", " + std::to_string(tiles.size()) + (tiles.size() == 1 ? " tile" : " tiles"), bytes};
}

} // namespace mrf_apps

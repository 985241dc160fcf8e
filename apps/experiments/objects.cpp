// SPDX-License-Identifier: BSD-3-Clause
#include "objects.h"

#include "evaluate/surface_distance.h"
#include "figure_support.h"
#include "program.h"
#include "scan/analytic_surface.h"
#include "scan/mesh_surface.h"
#include "support/mesh_reader.h"
#include "wavy_shapes.h"

#include <cmath>
#include <filesystem>

namespace mrf_apps {

using pcl::mrf::Execution;
using Places = std::vector<Eigen::Vector3d>;

namespace {

const char* const cgalArchive = "/usr/share/doc/libcgal-dev/data.tar.gz";

ScanObject lazy(const std::string& id, const std::string& title, const std::string& origin,
                std::function<LoadedObject()> load)
{
  const auto object = std::make_shared<figures::Lazy<LoadedObject>>(std::move(load));
  return {id, title, origin, [object]() -> const LoadedObject& { return (*object)(); }};
}

/// The package brings its data as one archive.
SurfaceMesh meshOfCgal(const std::string& name)
{
  const TemporaryFolder folder;
  const std::string member = "data/meshes/" + name + ".off";
  runProgram({findProgram("tar"), "-xzf", cgalArchive, "-C", folder.path(""), member});
  return readMesh(folder.path(member));
}

} // namespace

LoadedObject loadMesh(const SurfaceMesh& mesh)
{
  const auto truth = std::make_shared<SurfaceDistance>(mesh);
  return {std::make_unique<pcl::mrf::scan::MeshSurface>(mesh.vertices, mesh.triangles),
          [truth](const Places& places, Execution& execution) { return truth->distances(places, execution); }};
}

LoadedObject loadShape(const std::string& description)
{
  auto surface = std::make_unique<pcl::mrf::scan::AnalyticSurface>(pcl::mrf::scan::makeShape(description));
  const shapes::Sdf distance = surface->distance();
  return {std::move(surface), [distance](const Places& places, Execution& execution) {
            std::vector<double> result(places.size());
            execution.forRange(static_cast<std::int64_t>(places.size()), 4096,
                               [&](std::int64_t begin, std::int64_t end) {
                                 for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
                                   result[i] = std::abs(distance(places[i]));
                               });
            return result;
          }};
}

std::vector<ScanObject> scanObjects(const ExperimentOptions& options)
{
  std::vector<ScanObject> result;
  const auto reference = [&](const std::string& name) { return options.data + "/reference/" + name + ".ply"; };
  const auto hasReference = [&](const std::string& name) {
    return !options.data.empty() && std::filesystem::exists(reference(name));
  };
  if (const auto mesh = figures::bunny())
    result.push_back(lazy("bunny", "bunny", "the Stanford bunny of Debian's glmark2-data",
                          [mesh = *mesh] { return loadMesh(mesh); }));
  else if (hasReference("bunny"))
    result.push_back(
        lazy("data-bunny", "bunny", "--data", [path = reference("bunny")] { return loadMesh(readMesh(path)); }));
  if (std::filesystem::exists(cgalArchive) && !findProgram("tar").empty())
    for (const char* name : {"armadillo", "bear"})
      result.push_back(lazy(name, name, "Debian's libcgal-demo", [=] { return loadMesh(meshOfCgal(name)); }));
  for (const char* name : {"igea", "nefertiti"})
    if (hasReference(name))
      result.push_back(lazy(name, name, "--data", [path = reference(name)] { return loadMesh(readMesh(path)); }));
  const auto generated = [&](const char* id, const char* title, SurfaceMesh (*make)(Execution&)) {
    result.push_back(lazy(id, title, "generated", [make] {
      Execution execution;
      return loadMesh(make(execution));
    }));
  };
  generated("wavy-torus", "wavy torus", wavyTorus);
  generated("wavy-box", "wavy box", wavyBox);
  return result;
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz/readers.h"

#include "support/errors.h"
#include "support/float_offset.h"
#include "support/gzip.h"
#include "support/mesh_reader.h"
#include "support/point_table.h"
#include "support/sensors.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

namespace fuzz {
namespace {

using namespace mrf_apps;

const std::string path = "file";

void requireLine(const std::string& message)
{
  require(!message.empty() && std::none_of(message.begin(), message.end(), [](char c) { return c >= 0 && c < ' '; }),
          "the message is not one line of text");
}

void readPointsAs(const char* type, const std::string& bytes)
{
  const PointTable table = parsePoints(type, path, bytes);
  const auto fits = [&](std::size_t size) { return size == 0 || size == table.size(); };
  require(table.size() > 0 && fits(table.normals.size()) && fits(table.colors.size()), "columns of different lengths");
  for (const auto& scalar : table.scalars)
    require(scalar.second.size() == table.size(), "a scalar of another length");
  require(table.views.size() == (table.sensors.empty() ? 0 : table.size()), "sensors without their views");
  for (const std::int32_t view : table.views)
    require(view >= 0 && static_cast<std::size_t>(view) < table.sensors.size(), "a view without a sensor");
  floatOffset(table.positions);
}

void unpack(const std::string& bytes)
{
  constexpr std::size_t limit = 1 << 18;
  require(unpackGzip(path, bytes, limit).size() <= limit, "more is unpacked than was allowed");
}

void readMeshAs(const char* type, const std::string& bytes)
{
  const SurfaceMesh mesh = parseMesh(type, path, bytes);
  require(!mesh.triangles.empty(), "no triangles");
  for (const auto& triangle : mesh.triangles)
    for (const std::int32_t vertex : triangle)
      require(vertex >= 0 && static_cast<std::size_t>(vertex) < mesh.vertices.size(), "a corner without a vertex");
}

} // namespace

void require(bool condition, const char* what)
{
  if (condition)
    return;
  std::fprintf(stderr, "%s\n", what);
  std::abort();
}

const std::vector<Reader>& readers()
{
  // 100: a face of PLY may take a byte of the file and eight of memory, in arrays that double while they grow and live
  // beside the triangles. LZF unpacks to 88 times as much, and a byte becomes a double.
  static const std::vector<Reader> all = {
      {"points-xyz", [](const std::string& bytes) { readPointsAs("xyz", bytes); }, 100},
      {"points-pts", [](const std::string& bytes) { readPointsAs("pts", bytes); }, 100},
      {"points-ptx", [](const std::string& bytes) { readPointsAs("ptx", bytes); }, 100},
      {"points-obj", [](const std::string& bytes) { readPointsAs("obj", bytes); }, 100},
      {"points-off", [](const std::string& bytes) { readPointsAs("off", bytes); }, 100},
      {"points-ply", [](const std::string& bytes) { readPointsAs("ply", bytes); }, 100},
      {"points-las", [](const std::string& bytes) { readPointsAs("las", bytes); }, 100},
      {"gzip", unpack, 100},
      {"points-pcd", [](const std::string& bytes) { readPointsAs("pcd", bytes); }, 88 * 20},
      {"mesh-ply", [](const std::string& bytes) { readMeshAs("ply", bytes); }, 100},
      {"mesh-obj", [](const std::string& bytes) { readMeshAs("obj", bytes); }, 100},
      {"mesh-off", [](const std::string& bytes) { readMeshAs("off", bytes); }, 100},
      {"mesh-stl", [](const std::string& bytes) { readMeshAs("stl", bytes); }, 100},
      {"sensors", [](const std::string& bytes) { parseSensors(path, bytes); }, 100},
      {"views", [](const std::string& bytes) { parseViews(path, bytes); }, 100},
      {"command-reconstruction", readReconstructionCommand, 1000}, // CLI11 keeps words several times, in lists
      {"command-evaluation", readEvaluationCommand, 1000},
      {"command-scan", readScanCommand, 1000}};
  return all;
}

bool runReader(const Reader& reader, const std::string& bytes)
{
  if (bytes.empty()) // a file is refused before it is read
    return false;
  try {
    reader.read(bytes);
    return true;
  } catch (const Information&) { // such as the help
    return true;
  } catch (const FileError& error) {
    const std::string message = error.what();
    require(message.rfind("'" + path + "': ", 0) == 0, "the message does not name the file");
    requireLine(message);
    return false;
  } catch (const UsageError& error) {
    requireLine(error.what());
    return false;
  }
}

} // namespace fuzz

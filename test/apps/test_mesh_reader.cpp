// SPDX-License-Identifier: BSD-3-Clause
// Every mesh format: written files are read again, and broken files are refused.
#include "support/errors.h"
#include "support/mesh_reader.h"
#include "support/point_table.h"
#include "support/scans.h"
#include "support/tool.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

using namespace mrf_apps;

namespace {

class MeshReader : public tool::Test {
protected:
  SurfaceMesh read(const std::string& name) const { return readMesh(path(name).string()); }

  SurfaceMesh parse(const std::string& name, const std::string& text) const
  {
    write(name, text);
    return read(name);
  }

  void expectRefused(const std::string& name, const std::string& text) const
  {
    write(name, text);
    try {
      read(name);
      ADD_FAILURE() << name << " was read";
    } catch (const FileError& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find(name), std::string::npos) << message;
      EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 0) << message;
    }
  }
};

/// A square pyramid without its base, with coordinates that floats hold.
SurfaceMesh pyramid()
{
  SurfaceMesh mesh;
  mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {1, 1, 1.5}};
  mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  return mesh;
}

/// Every other triangle of a lattice of side × side points, with points at `at(i, j)`.
template <typename At>
SurfaceMesh latticeMesh(int side, const At& at)
{
  SurfaceMesh mesh;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i)
      mesh.vertices.push_back(at(i, j));
  for (int j = 0; j + 1 < side; ++j)
    for (int i = 0; i + 1 < side; ++i)
      mesh.triangles.push_back({i + j * side, i + 1 + j * side, i + (j + 1) * side});
  return mesh;
}

/// An OFF file with the vertices of a mesh and one triangle.
std::string offOf(const SurfaceMesh& mesh)
{
  std::ostringstream off;
  off.precision(17);
  off << "OFF\n" << mesh.vertices.size() << " 1 0\n";
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    off << vertex.x() << ' ' << vertex.y() << ' ' << vertex.z() << '\n';
  return off.str() + "3 0 1 2\n";
}

/// Expects the same positions corner by corner.
void expectSameCorners(const SurfaceMesh& mesh, const SurfaceMesh& expected, double tolerance = 0)
{
  ASSERT_EQ(mesh.triangles.size(), expected.triangles.size());
  for (std::size_t t = 0; t < expected.triangles.size(); ++t)
    for (std::size_t corner = 0; corner < 3; ++corner)
      EXPECT_LE((mesh.vertices[mesh.triangles[t][corner]] - expected.vertices[expected.triangles[t][corner]]).norm(),
                tolerance);
}

} // namespace

TEST_F(MeshReader, readsWhatIsWritten)
{
  // A mesh that float holds; and steps of a centimeter in survey coordinates, which float resolves to half a meter.
  SurfaceMesh survey = latticeMesh(
      12, [](int i, int j) { return Eigen::Vector3d(431000 + .01 * i, 4.5e6 + .01 * j, 100 + .01 * ((i + j) % 2)); });
  survey.doublePrecision = true;
  for (const SurfaceMesh& mesh : {pyramid(), survey})
    for (const std::string format : {"ply", "obj", "stl"}) {
      SCOPED_TRACE(format);
      writeMesh(mesh, path("mesh." + format).string(), format);
      const SurfaceMesh again = read("mesh." + format);
      if (format == "stl") { // it numbers the vertices anew, and holds floats about an offset
        expectSameCorners(again, mesh, mesh.doublePrecision ? 1e-7 : 0);
        continue;
      }
      EXPECT_EQ(again.doublePrecision, mesh.doublePrecision);
      EXPECT_EQ(again.vertices, mesh.vertices);
      EXPECT_EQ(again.triangles, mesh.triangles);
    }
  EXPECT_EQ(parse("mesh.off", offOf(survey)).vertices, survey.vertices);
}

TEST_F(MeshReader, stlIsWrittenRelativeToAnOffset)
{
  SurfaceMesh mesh = pyramid();
  EXPECT_TRUE(offsetOfFloats(mesh, "stl").isZero(0));
  for (Eigen::Vector3d& vertex : mesh.vertices)
    vertex += Eigen::Vector3d(431000.01, -4.5e6 + .02, 100.03);
  mesh.doublePrecision = true;
  const Eigen::Vector3d offset = offsetOfFloats(mesh, "stl");
  EXPECT_LT((offset - mesh.vertices[4]).norm(), 3) << "near the mesh, whose diagonal is 3.2";
  EXPECT_EQ(offset, offset.array().round().matrix()) << "in whole units";
  writeMesh(mesh, path("mesh.stl").string(), "stl");
  expectSameCorners(read("mesh.stl"), mesh, 1e-6); // float holds numbers below 4 to 2.4e-7
  // The longest numbers fit into the header.
  for (Eigen::Vector3d& vertex : mesh.vertices)
    vertex = Eigen::Vector3d::Constant(-1.23456789012345e-101) + 1e-109 * vertex;
  writeMesh(mesh, path("tiny.stl").string(), "stl");
  EXPECT_EQ(tool::readText(path("tiny.stl")).size(), 84 + 50 * mesh.triangles.size());
}

TEST_F(MeshReader, stlInTextIsReadToItsEnd)
{
  const std::string facet = "facet normal 0 0 1\nouter loop\nvertex 4500000.01 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                            "endloop\nendfacet\n";
  const SurfaceMesh two =
      parse("two.stl", "solid a name\n" + facet + "endsolid a name\nsolid b\n" + facet + "endsolid\n");
  EXPECT_EQ(two.triangles.size(), 2u);
  EXPECT_EQ(two.vertices.size(), 3u);
  EXPECT_EQ(two.vertices[0].x(), 4500000.01) << "text is not rounded to float";
  for (const std::string& text : {"solid a\n" + facet, "solid a\n" + facet.substr(0, 60) + "\nendsolid a\n",
                                  "solid a\n" + facet + "endsolid a\nwhatever\n"})
    expectRefused("cut.stl", text);
}

TEST_F(MeshReader, inputsThatBrokeReadersBefore)
{
  SKIP_WITHOUT_SCANS();
  const std::filesystem::path folder = std::filesystem::path(MRF_SOURCE_DIR) / ".." / "shared" / "data" / "bad_inputs";
  expectRefused("s.stl", tool::readText(folder / "s.stl"));
  for (const std::string name : {"p1.pcd", "p4.pcd"})
    EXPECT_THROW(readPoints((folder / name).string()), FileError) << name;
}

TEST_F(MeshReader, filesOfVtkAreRefusedWithTheCommandThatConvertsThem)
{
  EXPECT_EQ(whyNotReadable("a mesh.VTK"),
            "does not end in ply, obj, off or stl, also with .gz; pcl_vtk2ply 'a mesh.VTK' mesh.ply makes "
            "a ply file of it");
  EXPECT_NE(whyNotReadable("mesh.vtp").find("ParaView"), std::string::npos);
  EXPECT_EQ(whyNotReadable("mesh.xyz"), "does not end in ply, obj, off or stl, also with .gz");
  EXPECT_EQ(whyNotReadable("mesh.STL"), "");
  EXPECT_EQ(whyNotReadable("mesh.ply.gz"), "");
  expectFailure({"mesh.vtk", "out.ply"}, 2, "pcl_vtk2ply 'mesh.vtk' mesh.ply");
  EXPECT_THROW(read("mesh.vtk"), UsageError);
}

TEST_F(MeshReader, offAndPolygons)
{
  const SurfaceMesh off = parse("mesh.off", "OFF # a square and a triangle\n\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
                                            "0 0 1\n4 0 1 2 3 255 0 0\n3 0 1 4\n");
  EXPECT_EQ(off.vertices.size(), 5u);
  const std::vector<std::array<std::int32_t, 3>> expected = {{0, 1, 2}, {0, 2, 3}, {0, 1, 4}};
  EXPECT_EQ(off.triangles, expected);
  EXPECT_EQ(parse("one.off", "OFF 3 1 3\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n").triangles.size(), 1u);
  const SurfaceMesh obj = parse("mesh.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\n"
                                            "f 1//1 2//1 3//1 4//1\nf -5 -4 -1\n");
  EXPECT_EQ(obj.triangles, expected);
  const SurfaceMesh ply = parse(
      "mesh.ply", "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
                  "element face 2\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
                  "0 0 1\n4 0 1 2 3\n3 0 1 4\n");
  EXPECT_EQ(ply.triangles, expected);
  const SurfaceMesh stl =
      parse("mesh.stl", "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                        "vertex 0 1 0\nendloop\nendfacet\nfacet normal 0 0 1\nouter loop\n"
                        "vertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n");
  EXPECT_EQ(stl.vertices.size(), 4u) << "equal corners are one vertex";
  EXPECT_EQ(stl.triangles.size(), 2u);
}

TEST(MergeVertices, equalCoordinatesBecomeOneVertex)
{
  const SurfaceMesh mesh = pyramid();
  SurfaceMesh soup;
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<std::int32_t>(soup.vertices.size());
    for (const std::int32_t v : triangle)
      soup.vertices.push_back(mesh.vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  soup.vertices.push_back(Eigen::Vector3d::Constant(std::nan("")));
  const SurfaceMesh merged = mergeVertices(soup);
  ASSERT_EQ(merged.vertices.size(), 6u) << "five corners and the one without a place";
  expectSameCorners(merged, mesh);
}

TEST_F(MeshReader, refusesTruncatedFiles)
{
  // So long that its end is behind whatever a reader buffers.
  const SurfaceMesh mesh = latticeMesh(60, [](int i, int j) { return Eigen::Vector3d(i, j, (i * j) % 7); });
  write("whole.off", offOf(mesh));
  // A cut OBJ file is a smaller one unless a face lost its vertices, which come first.
  for (const std::string format : {"ply", "stl", "off"}) {
    if (format != "off")
      writeMesh(mesh, path("whole." + format).string(), format);
    EXPECT_NO_THROW(read("whole." + format)) << format;
    const std::string text = tool::readText(path("whole." + format));
    for (const double share : {.02, .5, .98})
      expectRefused("cut." + format,
                    text.substr(0, static_cast<std::size_t>(share * static_cast<double>(text.size()))));
  }
}

TEST_F(MeshReader, refusesWhatIsNoMesh)
{
  for (const std::string format : {"ply", "obj", "off", "stl"}) {
    expectRefused("empty." + format, "");
    expectRefused("noise." + format, "It was a dark and stormy night;\nthe rain fell in torrents.\n");
    EXPECT_THROW(read("nowhere." + format), FileError);
  }
  EXPECT_THROW(parse("mesh.xyz", "0 0 0\n"), UsageError);
  expectRefused("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  expectRefused("points.off", "OFF\n1 0 0\n0 0 0\n");
  expectRefused("beyond.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n");
  expectRefused("negative.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n");
  expectRefused("short.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n");
  expectRefused("beyond.ply",
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
                "float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n"
                "0 1 0\n3 0 1 3\n");
}

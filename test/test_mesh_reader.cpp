// Every mesh format: what is written is read again, and what is broken is refused.
#include "support/errors.h"
#include "support/mesh_reader.h"
#include "support/tool.h"

#include <algorithm>
#include <cmath>

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

/// A pyramid over a square whose base is open, in coordinates that floats hold.
SurfaceMesh pyramid()
{
  SurfaceMesh mesh;
  mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {1, 1, 1.5}};
  mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  return mesh;
}

} // namespace

TEST_F(MeshReader, readsWhatIsWritten)
{
  const SurfaceMesh mesh = pyramid();
  for (const std::string format : {"ply", "obj", "stl", "vtk", "vtp"}) {
    SCOPED_TRACE(format);
    writeMesh(mesh, path("mesh." + format).string(), format);
    const SurfaceMesh again = read("mesh." + format);
    EXPECT_FALSE(again.doublePrecision);
    ASSERT_EQ(again.vertices.size(), mesh.vertices.size());
    ASSERT_EQ(again.triangles.size(), mesh.triangles.size());
    // STL numbers the vertices anew; positions corner by corner are the same everywhere.
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (std::size_t corner = 0; corner < 3; ++corner)
        EXPECT_EQ(again.vertices[static_cast<std::size_t>(again.triangles[t][corner])],
                  mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][corner])]);
    if (format != "stl") {
      EXPECT_EQ(again.triangles, mesh.triangles);
    }
  }
}

TEST_F(MeshReader, keepsDoublePrecision)
{
  SurfaceMesh mesh = pyramid();
  for (Eigen::Vector3d& vertex : mesh.vertices)
    vertex += Eigen::Vector3d(5e6 + .0625, 4e5, 0);
  mesh.doublePrecision = true;
  for (const std::string format : {"ply", "obj", "vtk", "vtp"}) {
    SCOPED_TRACE(format);
    writeMesh(mesh, path("mesh." + format).string(), format);
    const SurfaceMesh again = read("mesh." + format);
    EXPECT_TRUE(again.doublePrecision);
    EXPECT_EQ(again.vertices, mesh.vertices);
  }
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
  const SurfaceMesh vtk = parse(
      "mesh.vtk", "# vtk DataFile Version 3.0\nstrip\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0\n1 0 0\n0 1 0\n"
                  "1 1 0\nTRIANGLE_STRIPS 1 5\n4 0 1 2 3\n");
  // Both face up.
  const std::vector<std::array<std::int32_t, 3>> strip = {{0, 1, 2}, {1, 3, 2}};
  EXPECT_EQ(vtk.triangles, strip);
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
      soup.vertices.push_back(mesh.vertices[static_cast<std::size_t>(v)]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  soup.vertices.push_back(Eigen::Vector3d::Constant(std::nan("")));
  const SurfaceMesh merged = mergeVertices(soup);
  ASSERT_EQ(merged.vertices.size(), 6u) << "five corners and the one without a place";
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t corner = 0; corner < 3; ++corner)
      EXPECT_EQ(merged.vertices[static_cast<std::size_t>(merged.triangles[t][corner])],
                mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][corner])]);
}

TEST_F(MeshReader, refusesTruncatedFiles)
{
  // So long that its end is behind whatever a reader buffers.
  SurfaceMesh mesh;
  constexpr int side = 60;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i)
      mesh.vertices.emplace_back(i, j, (i * j) % 7);
  for (int j = 0; j + 1 < side; ++j)
    for (int i = 0; i + 1 < side; ++i)
      mesh.triangles.push_back({i + j * side, i + 1 + j * side, i + (j + 1) * side});
  std::string off = "OFF\n3600 1 0\n";
  for (const Eigen::Vector3d& vertex : mesh.vertices)
    off += std::to_string(vertex.x()) + " " + std::to_string(vertex.y()) + " 0\n";
  write("whole.off", off + "3 0 1 2\n");
  // A cut OBJ file is a smaller one unless a face lost its vertices, which come first.
  for (const std::string format : {"ply", "stl", "vtk", "vtp", "off"}) {
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
  for (const std::string format : {"ply", "obj", "off", "stl", "vtk", "vtp"}) {
    expectRefused("empty." + format, "");
    expectRefused("noise." + format, "It was a dark and stormy night;\nthe rain fell in torrents.\n");
    EXPECT_THROW(read("nowhere." + format), FileError);
  }
  EXPECT_THROW(parse("mesh.xyz", "0 0 0\n"), UsageError);
  expectRefused("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  expectRefused("points.off", "OFF\n1 0 0\n0 0 0\n");
  expectRefused("beyond.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
  expectRefused("beyond.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n");
  expectRefused("negative.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n");
  expectRefused("short.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n");
  expectRefused("huge.off", "OFF\n1e300 1 0\n0 0 0\n");
  expectRefused("beyond.ply",
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
                "float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n"
                "0 1 0\n3 0 1 3\n");
  const std::string vtkPoints = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0\n"
                                "1 0 0\n0 1 0\n";
  for (const char* polygons : {"POLYGONS 1 4\n3 0 1\n", "POLYGONS 1 4\n4 0 1 2 0\n", "POLYGONS 2 4\n3 0 1 2\n",
                               "POLYGONS 1 9\n3 0 1 2\n", "POLYGONS 1 4\n-3 0 1 2\n", "POLYGONS\n3 0 1 2\n"})
    expectRefused("cells.vtk", vtkPoints + polygons);
  expectRefused("grid.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n");
  expectRefused("beyond.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0\n1 0 0\n"
                              "0 1 0\nPOLYGONS 1 4\n3 0 1 3\n");
}

// SPDX-License-Identifier: BSD-3-Clause
// Point files, plain and packed by gzip: digits are kept, headers are not trusted.
#include "support/errors.h"
#include "support/float_offset.h"
#include "support/gzip.h"
#include "support/mesh_reader.h"
#include "support/point_readers.h"
#include "support/point_table.h"
#include "support/surface_mesh.h"
#include "support/tool.h"

#include <pcl/surface/mrf/distance_field.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <regex>
#include <sstream>
#include <tuple>

using namespace mrf_apps;

namespace {

using Color = std::array<std::uint8_t, 3>;
using Points = std::vector<Eigen::Vector3d>;
using Normals = std::vector<Eigen::Vector3f>;

PointTable parse(const std::string& type, const std::string& text)
{
  return parsePoints(type, "file." + type, text);
}

/// A plane with steps of 1 cm in survey coordinates, where floats are .5 m apart.
Points surveyPlane()
{
  Points points;
  for (int j = 0; j < 20; ++j)
    for (int i = 0; i < 20; ++i)
      points.emplace_back(431000 + .01 * i, 4.5e6 + .01 * j, 100 + .01 * ((i + j) % 2));
  return points;
}

std::string rows(const Points& points, const std::string& start = {}, const std::string& end = {},
                 const std::string& between = " ")
{
  std::ostringstream text;
  text.precision(17);
  for (const Eigen::Vector3d& p : points)
    text << start << p.x() << between << p.y() << between << p.z() << end << "\n";
  return text.str();
}

template <typename T>
std::string bytesOf(T value, bool isReversed = false)
{
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (isReversed)
    std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::string doubles(const Points& points, bool isReversed = false)
{
  std::string bytes;
  for (const Eigen::Vector3d& p : points)
    for (const double value : p)
      bytes += bytesOf(value, isReversed);
  return bytes;
}

/// \param more properties behind x y z, as lines
std::string plyHeader(std::size_t count, const std::string& format, const std::string& more = {})
{
  return "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(count) +
         "\nproperty double x\nproperty double y\nproperty double z\n" + more + "end_header\n";
}

std::string pcdHeader(std::size_t count, const std::string& size, const std::string& data)
{
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE " + size + "\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " +
         std::to_string(count) + "\nHEIGHT 1\nPOINTS " + std::to_string(count) + "\nDATA " + data + "\n";
}

/// LZF without any compression: runs of up to 32 literal bytes.
std::string lzf(const std::string& bytes)
{
  std::string packed;
  for (std::size_t at = 0; at < bytes.size(); at += 32) {
    const std::string run = bytes.substr(at, 32);
    packed += static_cast<char>(run.size() - 1) + run;
  }
  return bytesOf(static_cast<std::uint32_t>(packed.size())) + bytesOf(static_cast<std::uint32_t>(bytes.size())) +
         packed;
}

template <typename Read>
void expectRefusedBy(const Read& read, const std::string& words)
{
  try {
    read();
    ADD_FAILURE() << "was read: " << words;
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

void expectRefused(const std::string& type, const std::string& text, const std::string& words = "file.")
{
  SCOPED_TRACE(text.substr(0, 200));
  expectRefusedBy([&] { parse(type, text); }, words);
}

class PointReaders : public tool::Test {};

template <typename T>
void put(std::string& bytes, std::size_t at, T value)
{
  std::memcpy(&bytes.at(at), &value, sizeof(T));
}

struct LasPoint {
  std::array<std::int32_t, 3> steps;
  std::uint16_t intensity;
  std::array<std::uint16_t, 3> color;
};

/// Steps of 1 cm from 431000, 4500000, 100; offsets and sizes are those of the specification.
std::string lasFile(int minor, std::size_t format, const std::vector<LasPoint>& points)
{
  constexpr std::array<std::size_t, 11> sizes = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67},
                                        reds = {0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};
  const std::size_t header = minor == 4 ? 375 : minor == 3 ? 235 : 227;
  std::string bytes(header, '\0');
  bytes.replace(0, 4, "LASF");
  put(bytes, 24, std::uint8_t{1});
  put(bytes, 25, static_cast<std::uint8_t>(minor));
  put(bytes, 94, static_cast<std::uint16_t>(header));
  put(bytes, 96, static_cast<std::uint32_t>(header + 7)); // behind a record of something else
  put(bytes, 104, static_cast<std::uint8_t>(format));
  put(bytes, 105, static_cast<std::uint16_t>(sizes[format] + 1)); // with a byte of somebody's own
  put(bytes, 107, format < 6 ? static_cast<std::uint32_t>(points.size()) : 0U);
  if (minor == 4)
    put(bytes, 247, std::uint64_t{points.size()});
  const std::array<double, 3> offset = {431000, 4500000, 100};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put(bytes, 131 + 8 * axis, .01);
    put(bytes, 155 + 8 * axis, offset[axis]);
  }
  bytes += "records";
  for (const LasPoint& point : points) {
    std::string record(sizes[format] + 1, '\0');
    put(record, 0, point.steps);
    put(record, 12, point.intensity);
    if (reds[format] > 0)
      put(record, reds[format], point.color);
    bytes += record;
  }
  return bytes;
}

const std::vector<LasPoint> twoPoints = {{{-1, 2, 3}, 65535, {257, 514, 65535}}, {{4, 5, -6}, 7, {0, 0, 771}}};

} // namespace

TEST(PointReader, everyFormatKeepsTheDigits)
{
  const Points points = surveyPlane();
  const std::size_t count = points.size();
  std::string byField; // x of all, then y, then z
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    for (const Eigen::Vector3d& p : points)
      byField += bytesOf(p[axis]);
  const std::vector<std::pair<std::string, std::string>> files = {
      {"xyz", rows(points)},
      {"txt", rows(points, "", " 0 0 1")},
      {"csv", "X,Y,Z\n" + rows(points, {}, {}, ",")},
      {"asc", "//X Y Z\n" + rows(points)},
      {"obj", rows(points, "v ")},
      {"ply", plyHeader(count, "ascii") + rows(points)},
      {"ply", plyHeader(count, "binary_little_endian") + doubles(points)},
      {"ply", plyHeader(count, "binary_big_endian") + doubles(points, true)},
      {"pcd", pcdHeader(count, "8 8 8", "ascii") + rows(points)},
      {"pcd", pcdHeader(count, "4 4 4", "ascii") + rows(points)}, // what the text says counts
      {"pcd", pcdHeader(count, "8 8 8", "binary") + doubles(points)},
      {"pcd", pcdHeader(count, "8 8 8", "binary_compressed") + lzf(byField)}};
  for (const auto& [type, text] : files) {
    SCOPED_TRACE(type + text.substr(0, 60));
    EXPECT_EQ(parse(type, text).positions, points);
    EXPECT_FALSE(parse(type, text).areFloats);
  }
}

TEST_F(PointReaders, writersKeepTheDigits)
{
  PointTable table;
  table.positions = surveyPlane();
  for (const std::string format : {"ply", "pcd"}) {
    writePoints(table, path("plane." + format).string(), format);
    EXPECT_EQ(readPoints(path("plane." + format).string()).positions, table.positions) << format;
  }
  // The origin of a field's image is all of its position.
  pcl::mrf::Lattice lattice;
  lattice.size = {3, 3, 3};
  lattice.origin = Eigen::Vector3d(.12, .34, .56);
  lattice.spacing = .01;
  const Eigen::Vector3d offset(431000.01, 4500000.02, 100.03);
  writeField(pcl::mrf::DistanceField(lattice, std::vector<float>(27, 1.f), {}), offset, path("field.vti").string());
  const std::string text = tool::readText(path("field.vti"));
  const std::size_t origin = text.find("Origin=\"") + 8;
  std::istringstream numbers(text.substr(origin, text.find('"', origin) - origin));
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    double value = 0;
    numbers >> value;
    EXPECT_EQ(value, (lattice.origin + offset)[axis]);
  }
}

TEST(PointReader, straysCostTheOthersNoDigits)
{
  Points points = surveyPlane();
  EXPECT_LT((floatOffset(points) - points[200]).norm(), 1);
  points.emplace_back(0, 0, 0);
  points.emplace_back(Eigen::Vector3d::Constant(std::nan("")));
  const Eigen::Vector3d offset = floatOffset(points);
  for (std::size_t i = 0; i < 400; ++i) {
    const Eigen::Vector3d kept = (points[i] - offset).cast<float>().cast<double>() + offset;
    EXPECT_LT((kept - points[i]).norm(), 1e-6) << "of steps of .01"; // .2 in float have digits of 10⁻⁸
  }
  EXPECT_TRUE(floatOffset({{1, 2, 3}, {.5, .25, 7}}).isZero(0)) << "float holds these";
  EXPECT_FALSE(floatOffset({{0, 5405590, 352}, {59, 5405649, 354}}).isZero(0)) << "these, but nothing between them";
}

TEST(PointReader, floatsShowToWhatTheyAreRounded)
{
  EXPECT_EQ(floatRounding({{431000.5, 5000001, 350}, {431001, 5000002, 351}}), 0) << "whole and half ones";
  EXPECT_EQ(floatRounding({{431000, 5000000.5, 350}}), .5f);
  EXPECT_EQ(floatRounding({{431000.03125, 5000001, 350}}), .03125f);
  EXPECT_EQ(floatRounding({{std::nan(""), 1e300, 1}}), 0);
}

// Float holds points in whole or half meters, but not the vertices between them.
TEST_F(PointReaders, gridsInSurveyCoordinatesKeepTheirHeights)
{
  const auto height = [](double x, double y) { return 350 + 3 * std::sin(x / 9) * std::cos(y / 11); };
  const Eigen::Vector3d corner(431000, 5000000, 0);
  for (const double step : {1., .5}) {
    Points points;
    std::string bytes = std::regex_replace(plyHeader(1600, "binary_little_endian"), std::regex("double"), "float");
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i) {
        points.push_back(corner + Eigen::Vector3d(step * i, step * j, height(step * i, step * j)));
        for (const double value : points.back())
          bytes += bytesOf(static_cast<float>(value));
      }
    write("grid.xyz", rows(points));
    write("grid.ply", bytes);
    write(step < 1 ? "halves.ply" : "whole.ply", bytes);
    for (const char* name : {"grid.xyz", "grid.ply"}) {
      SCOPED_TRACE(name + std::string(" in steps of ") + std::to_string(step));
      const tool::Outcome outcome = succeed({name, "mesh.ply", "-q"});
      // Single precision has rounded halves, as far as one sees, but no whole meters.
      const bool isRounded = step < 1 && std::string(name) == "grid.ply";
      EXPECT_EQ(outcome.err.find("resolved to 0.5 only") != std::string::npos, isRounded) << outcome.err;
      const SurfaceMesh mesh = readMesh(path("mesh.ply").string());
      double squares = 0;
      std::size_t halves = 0;
      for (const Eigen::Vector3d& vertex : mesh.vertices) {
        const Eigen::Vector3d local = vertex - corner;
        squares += std::pow(local.z() - height(local.x(), local.y()), 2);
        halves += std::fmod(local.y(), .5) == 0;
      }
      // Where y is rounded to halves, its quarter times the slope, up to .33, adds .04.
      EXPECT_LT(std::sqrt(squares / static_cast<double>(mesh.vertices.size())), .02 * step);
      EXPECT_LT(halves, mesh.vertices.size() / 20);
    }
  }
  const tool::Outcome joined = run({"halves.ply", "whole.ply", "mesh.ply", "-q"});
  EXPECT_NE(joined.err.find("resolved to 0.5 only"), std::string::npos) << joined.err << "the coarsest file counts";
}

TEST(PointReader, colorsOfAnyValueAreBytes)
{
  EXPECT_EQ(toByte(std::nan("")), 0);
  EXPECT_EQ(toByte(-1e300), 0);
  EXPECT_EQ(toByte(1e300), 255);
  EXPECT_EQ(toByte(254.4), 254);
  EXPECT_EQ(toByte(254.5), 255);
  for (const std::string value : {"nan", "1e300", "-1e300", "inf", "-inf"}) {
    const std::uint8_t expected = value == "1e300" || value == "inf" ? 255 : 0;
    const std::string three = value + " " + value + " " + value;
    const auto red = [](const PointTable& table) { return static_cast<int>(table.colors.at(0)[0]); };
    EXPECT_EQ(red(parse("obj", "v 0 0 0 " + three + "\n")), expected) << value;
    const std::string channels = "property float red\nproperty float green\nproperty float blue\n";
    EXPECT_EQ(red(parse("ply", plyHeader(1, "ascii", channels) + "0 0 0 " + three + "\n")), expected) << value;
    const std::string pcd = "FIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nPOINTS 1\nDATA ascii\n";
    EXPECT_EQ(red(parse("pcd", pcd + "0 0 0 " + value + "\n")), 0) << value;
  }
}

TEST(PcdReader, fieldsOfEveryType)
{
  const std::string names = "FIELDS x y z intensity rgb _ normal_x normal_y normal_z vector\n";
  const std::string header = names +
                             "SIZE 4 8 2 1 4 1 4 4 4 4\nTYPE F F I U F U F F F F\n"
                             "COUNT 1 1 1 1 1 3 1 1 1 2\nWIDTH 1\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\n";
  const std::uint32_t color = 0xff102030;
  std::string binary;
  for (int i = 0; i < 2; ++i) {
    binary += bytesOf(1.5f + static_cast<float>(i)) + bytesOf(.1) + bytesOf(std::int16_t{-3}) +
              bytesOf(std::uint8_t{200}) + bytesOf(color) + "abc" + bytesOf(0.f) + bytesOf(0.f) + bytesOf(1.f) +
              bytesOf(7.f) + bytesOf(8.f);
  }
  const PointTable table = parse("pcd", header + "DATA binary\n" + binary);
  ASSERT_EQ(table.size(), 2u);
  EXPECT_TRUE(table.areFloats);
  EXPECT_EQ(table.positions[1], Eigen::Vector3d(2.5, .1, -3));
  EXPECT_EQ(table.normals.at(1), Eigen::Vector3f(0, 0, 1));
  EXPECT_EQ(table.scalars.at("intensity"), (std::vector<float>{200, 200}));
  EXPECT_EQ(table.scalars.count("vector"), 0u);
  EXPECT_EQ(table.colors.at(1), (Color{0x10, 0x20, 0x30}));
}

TEST(PcdReader, viewpointIsTheSensor)
{
  const auto originOf = [](const std::string& viewpoint, int height) {
    const std::string size = "WIDTH 2\nHEIGHT " + std::to_string(height) + "\nPOINTS " + std::to_string(2 * height);
    std::string text = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n" + viewpoint + size + "\nDATA ascii\n";
    for (int i = 0; i < 2 * height; ++i)
      text += "1 2 3\n";
    return parse("pcd", text).sensorOrigin;
  };
  EXPECT_EQ(originOf("VIEWPOINT 431000.01 4500000.02 -1 1 0 0 0\n", 1), Eigen::Vector3d(431000.01, 4500000.02, -1));
  EXPECT_EQ(originOf("VIEWPOINT 0 0 0 1 0 0 0\n", 2), Eigen::Vector3d(0, 0, 0)) << "organized";
  EXPECT_FALSE(originOf("VIEWPOINT 0 0 0 1 0 0 0\n", 1)) << "nobody has set it";
  const auto ofImage = [](const std::string& rows) {
    return parse("pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nVIEWPOINT 0 0 0 1 0 0 0\nWIDTH 2\nHEIGHT 2\nPOINTS 4\n"
                        "DATA ascii\n" +
                            rows)
        .sensorOrigin;
  };
  EXPECT_EQ(ofImage("0 0 5\n1 0 5\n0 1 5\n1 1 5\n"), Eigen::Vector3d(0, 0, 0));
  EXPECT_FALSE(ofImage("1 0 5\n0 0 5\n1 1 5\n0 1 5\n")) << "moved, so that zero is behind it";
  EXPECT_FALSE(originOf("VIEWPOINT nan 0 0 1 0 0 0\n", 2));
  EXPECT_FALSE(originOf("", 2));
  EXPECT_THROW(originOf("VIEWPOINT 0 0 0 1 0 0\n", 1), FileError);
  EXPECT_THROW(originOf("VIEWPOINT 0 0 0 one 0 0 0\n", 1), FileError);
}

TEST(PcdReader, headersAreNotBelieved)
{
  const std::string good = pcdHeader(1, "4 4 4", "binary"), body(12, '\1');
  EXPECT_NO_THROW(parse("pcd", good + body));
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text + body;
  };
  expectRefused("pcd", with("POINTS 1", "POINTS 150000000x"), "line 9");
  expectRefused("pcd", with("POINTS 1", "POINTS 150000000\nPOINTS 1"), "second line POINTS");
  expectRefused("pcd", with("POINTS 1", "POINTS 150000000"), "truncated");
  expectRefused("pcd", with("POINTS 1", "POINTS 4294967296"), "line 9");
  expectRefused("pcd", with("POINTS 1", "POINTS -1"), "line 9");
  expectRefused("pcd", with("POINTS 1", "POINTS"), "line 9");
  expectRefused("pcd", with("WIDTH 1", "WIDTH 2"), "width and height");
  expectRefused("pcd", with("HEIGHT 1", "HEIGHT 1e9"), "line 8");
  expectRefused("pcd", with("SIZE 4 4 4", "SIZE 4 4"), "line 4");
  expectRefused("pcd", with("SIZE 4 4 4", "SIZE 4 4 3"), "no type F of 3 bytes");
  expectRefused("pcd", with("TYPE F F F", "TYPE F F X"), "no type X");
  expectRefused("pcd", with("COUNT 1 1 1", "COUNT 1 1 99999999999999"), "line 6");
  expectRefused("pcd", with("COUNT 1 1 1", "COUNT 1 1 0"), "line 6");
  expectRefused("pcd", with("COUNT 1 1 1", "SHAPE round"), "line 6");
  expectRefused("pcd", with("DATA binary", "DATA zip"), "line 10");
  expectRefused("pcd", with("FIELDS x y z", "FIELDS x y y"), "x, y and z");
  expectRefused("pcd", good + body.substr(1), "truncated");
}

TEST(PcdReader, compressedSizesAreNotBelieved)
{
  const auto file = [](std::uint32_t points, std::uint32_t packed, std::uint32_t unpacked, const std::string& data) {
    return pcdHeader(points, "4 4 4", "binary_compressed") + bytesOf(packed) + bytesOf(unpacked) + data;
  };
  const std::string literals = '\13' + std::string(12, '\1'); // control 11: twelve bytes follow
  EXPECT_EQ(parse("pcd", file(1, 13, 12, literals)).size(), 1u);
  // Four bytes, then a copy of eight from four back.
  const std::string copy = std::string("\3\0\0\200\77", 5) + std::string("\300\3", 2);
  const PointTable copied = parse("pcd", file(1, 7, 12, copy));
  EXPECT_EQ(copied.positions.at(0), Eigen::Vector3d(1, 1, 1));
  expectRefused("pcd", file(1, 13, 24, literals));
  expectRefused("pcd", file(1, 14, 12, literals));
  expectRefused("pcd", file(1, 12, 12, literals));
  expectRefused("pcd", file(2, 13, 24, literals));
  expectRefused("pcd", file(1, 7, 12, std::string("\3\0\0\200\77", 5) + std::string("\300\4", 2)));
  expectRefused("pcd", file(100000000, 13, 1200000000, literals), "truncated");
  expectRefused("pcd", pcdHeader(1, "4 4 4", "binary_compressed") + "abc");
}

TEST(PointReader, whatIsNoCloudIsRefused)
{
  const std::string png = std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\1\0\0\0\1\0", 24) + std::string(300, '\x55');
  for (const std::string type : {"ply", "pcd", "obj", "xyz", "txt"})
    for (const std::string& text : {png, std::string("It was a dark and stormy night;\nthe rain fell.\n"),
                                    std::string("\n\n\n"), png.substr(0, 3)})
      expectRefused(type, text);
  expectRefused("ply", png, "is not a PLY file");
  expectRefused("ply", plyHeader(400, "binary_little_endian") + std::string(400 * 24 - 1, '\1'), "truncated");
  expectRefused("ply", plyHeader(4000000000, "binary_little_endian"), "truncated");
  expectRefused("ply", plyHeader(400, "binary_little_endian").substr(0, 80));
  expectRefused("ply", std::regex_replace(plyHeader(1, "ascii"), std::regex(" z"), " w") + "1 2 3\n", "x, y and z");
  expectRefused("ply", plyHeader(2, "ascii") + "1 2 3\n4 O 6\n", "holds 'O' in place of a number");
  expectRefused("ply", plyHeader(2, "ascii") + "1 2 3\n4 5\n", "declares more numbers than it holds");
  const std::string ply = plyHeader(1, "ascii") + "1 2 3\n";
  for (const std::string type : {"pcd", "xyz", "las", "obj"})
    expectRefused(type, ply, "is read as " + type + " and begins as ply does: say --input-format ply");
  expectRefused("ply", pcdHeader(1, "4 4 4", "ascii") + "1 2 3\n", "begins as pcd does");
  expectRefused("ply", "1 2 3\n", "begins as xyz does");
  expectRefused("pcd", pcdHeader(400, "4 4 4", "binary_compressed") + std::string(60, '\1'), "truncated");
  expectRefused("pcd", pcdHeader(400, "4 4 4", "ascii") + "1 2 3\n4 5 6\n", "truncated");
  expectRefused("pcd", pcdHeader(1, "4 4 4", "ascii") + "1 2 x\n");
  expectRefused("pcd", png, "is not a PCD file");
  expectRefused("pcd", pcdHeader(400, "4 4 4", "ascii").substr(0, 40));
  // Both crash PCL's reader, or what reads its result.
  expectRefused("pcd", "FIELDS x y z\nDATA ascii\n1 2 3\n");
  expectRefused("pcd",
                "FIELDS x y z rgb\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1\nPOINTS 1\nDATA binary\n0123456789abc");
  expectRefused("xyz", "5\n0 0 0\n1 0 0\n0 1 0\n", "announces 5 points and holds 3");
  for (const std::string row : {"0 1", "1 0 zero", "1 0 0 5"})
    expectRefused("xyz", "0 0 0\n1 0 0\n" + row, "line 3");
  expectRefused("obj", "v 0 0 0\nv 1 0 0\nv 0 1\n", "line 3");
  expectRefused("obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n", "is not there");
  expectRefused("ply", plyHeader(1, "ascii 1.0\nformat ascii") + "0 0 0\n", "line 3");
  expectRefused("ply", plyHeader(1000000000000000000, "binary_little_endian") + "0000");
  expectRefused("ply", plyHeader(1, "ascii", "property list float int a\n") + "0 0 0 1.5 7\n");
  expectRefused("xyz", "1e300\n0 0 0\n", "line 1");
  expectRefused("xyz", "inf\n0 0 0\n", "line 1");
  expectRefused("xyz", "2147483647\n0 0 0\n", "announces 2147483647 points");
}

TEST(PlyReader, otherElementsAndPropertiesArePassedOver)
{
  const Points expected = {{.5, 1, 2}, {3, 4, 5}};
  // Doubles, a list among the vertex properties, faces, and an element nobody knows.
  const std::string lists = "ply\nformat ascii 1.0\ncomment scanned\nelement vertex 2\nproperty double x\n"
                            "property double y\nproperty double z\nproperty list uchar int neighbors\n"
                            "property uchar quality\nelement face 1\nproperty list uchar int vertex_indices\n"
                            "element box 1\nproperty float side\nend_header\n";
  EXPECT_EQ(parse("ply", lists + ".5 1 2 2 0 1 7\n3 4 5 0 7\n3 0 1 0\n1.5\n").positions, expected);
  // Big-endian floats behind another element, and lines as Windows ends them.
  std::string big =
      "ply\r\nformat binary_big_endian 1.0\r\nelement box 1\r\nproperty short side\r\nelement vertex 2\r\n"
      "property float x\r\nproperty float y\r\nproperty float z\r\nend_header\r\n";
  big += std::string("\0\1", 2);
  for (const Eigen::Vector3d& p : expected)
    for (const double value : p)
      big += bytesOf(static_cast<float>(value), true);
  EXPECT_EQ(parse("ply", big).positions, expected);
  EXPECT_TRUE(parse("ply", big).areFloats);
}

TEST(ObjReader, pairsNormalsByIndex)
{
  // Normals in the opposite order; the second face counts from the end.
  const PointTable table = parse("obj", "mtllib none.mtl\no triangles\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 -1\n"
                                        "vn 0 0 1\nvn 0 1 0\nvn 1 0 0\nf 1//4 2//3 3//2\nf -4//-1 -2//-3 -1//-4\n");
  EXPECT_EQ(table.normals, (Normals{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, -1}}));
  EXPECT_TRUE(parse("obj", "v 0 0 0\nv 1 0 0\n").normals.empty());
}

TEST(XyzReader, takesEveryKindOfHeaderAndSeparator)
{
  for (const char* text : {"1 2 3 0 0 1\n4 5 6 0 1 0\n", "// from a scanner\n2\n1 2 3 0 0 1\n4 5 6 0 1 0\n",
                           "X Y Z Nx Ny Nz\n1,2,3,0,0,1\n4,5,6,0,1,0\n", "# exported\n\n1 2 3 0 0 1\r\n4 5 6 0 1 0\r\n",
                           "x,y,z,nx,ny,nz\r1,2,3,0,0,1\r4,5,6,0,1,0\r"}) {
    const PointTable table = parse("xyz", text);
    EXPECT_EQ(table.positions, (Points{{1, 2, 3}, {4, 5, 6}})) << text;
    EXPECT_EQ(table.normals, (Normals{{0, 0, 1}, {0, 1, 0}})) << text;
  }
  const PointTable colored = parse("xyz", "1 2 3 200 100 50\n4 5 6 200 100 50\n");
  EXPECT_TRUE(colored.normals.empty());
  EXPECT_EQ(colored.colors.at(1), (Color{200, 100, 50}));
  expectRefused("csv", std::string("\xff\xfex\0,\0y\0", 8), "is text in UTF-16: save it as UTF-8");
  // Numbers beyond doubles.
  const PointTable far = parse("xyz", "0 1e999 -1e999\n1e-999 0." + std::string(400, '0') + "1 1\n");
  EXPECT_FALSE(std::isfinite(far.positions[0].y()) || std::isfinite(far.positions[0].z()));
  EXPECT_EQ(far.positions[1], Eigen::Vector3d(0, 0, 1));
}

TEST(XyzReader, tracksOfColmapAreAsLongAsTheyAre)
{
  const std::string header = "# 3D point list with one line of data per point:\n"
                             "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n"
                             "# Number of points: 2, mean track length: 3\n";
  const PointTable table =
      parse("txt", header + "7 1 2 3 10 20 30 .5 1 17 2 9\n9 4 5 6 40 50 60 .25 1 3 2 5 3 8 4 1\n");
  EXPECT_EQ(table.positions, (Points{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_EQ(table.colors, (std::vector<Color>{{10, 20, 30}, {40, 50, 60}}));
  EXPECT_EQ(table.scalars.at("ERROR"), (std::vector<float>{.5, .25}));
  expectRefused("txt", header + "7 1 2 3 10 20 30 .5 1 17\n9 4 5 6 40\n", "line 5: has 5 columns, those before have 8");
  EXPECT_EQ(parse("txt", "# X [m] Y Z[] as (\n1 2 3\n").positions, (Points{{1, 2, 3}})) << "a list instead of z";
}

TEST(XyzReader, columnsAreWhatTheHeaderNames)
{
  for (const char* text :
       {"//X Y Z R G B Nx Ny Nz\n1 2 3 10 20 30 0 0 1\n4 5 6 40 50 60 0 1 0\n",
        "x y z nx ny nz red green blue\n1 2 3 0 0 1 10 20 30\n4 5 6 0 1 0 40 50 60\n",
        "blue,point id,green,red,Normal_X,normal_y,normal_z,Z,Y,X\n30,7,20,10,0,0,1,3,2,1\n60,8,50,40,0,1,0,6,5,4\n",
        "\"x\";\"y\";\"z\";\"NormalX\";\"NormalY\";\"NormalZ\";\"r\";\"g\";\"b\";\n1;2;3;0;0;1;10;20;30\n4;5;6;0;1;0;"
        "40;50;60\n",
        "# from LAS\n#x\ty\tz\tr\tg\tb\tnx\tny\tnz\n1 2 3 2570 5140 7710 0 0 1\n4 5 6 10280 12850 15420 0 1 0\n",
        "X [m], Y [m], Z [m], Nx, Ny, Nz, R (0-255), red, green, "
        "blue\n1,2,3,0,0,1,7,10,20,30\n4,5,6,0,1,0,7,40,50,60\n",
        "2\nX(m) Y(m) Z [m] nx ny nz r g b\n1 2 3 0 0 1 10 20 30\n4 5 6 0 1 0 40 50 60\n",
        "POINT_X,POINT_Y,POINT_Z,nx,ny,nz,r,g,b\n1,2,3,0,0,1,10,20,30\n4,5,6,0,1,0,40,50,60\n",
        "Z Coordinate,X Coordinate,Y Coordinate,nx,ny,nz,r,g,b\n3,1,2,0,0,1,10,20,30\n6,4,5,0,1,0,40,50,60\n",
        "Northing;Easting;Elevation;nx;ny;nz;r;g;b\n2;1;3;0;0;1;10;20;30\n5;4;6;0;1;0;40;50;60\n",
        "1 2 3 0 0 1 10 20 30\n4 5 6 0 1 0 40 50 60\n", "1 2 3 10 20 30 0 0 1\n4 5 6 40 50 60 0 1 0\n"}) {
    SCOPED_TRACE(text);
    const PointTable table = parse("txt", text);
    EXPECT_EQ(table.positions, (Points{{1, 2, 3}, {4, 5, 6}}));
    EXPECT_EQ(table.normals, (Normals{{0, 0, 1}, {0, 1, 0}}));
    EXPECT_EQ(table.colors, (std::vector<Color>{{10, 20, 30}, {40, 50, 60}}));
  }
  const PointTable others = parse("csv", "X,Y,Z,Intensity,Scalar field\n1,2,3,.5,7\n4,5,6,.25,8\n");
  EXPECT_EQ(others.scalars,
            (std::map<std::string, std::vector<float>>{{"intensity", {.5, .25}}, {"Scalar field", {7, 8}}}));
  const PointTable fewer = parse("xyz", "x y z\n1 2 3 0 0 1\n4 5 6 0 1 0\n");
  EXPECT_EQ(fewer.normals.size(), 2u);
  EXPECT_EQ(fewer.notes, std::vector<std::string>{"3 columns have names, but the rows have 6: the names are ignored"});
  // Else the wrong columns would be x y z without a word.
  for (const char* other : {"nx ny nz x y z w\n0 0 1 1 2 3\n", "x,y,z\n0,5,1,5,2,5\n", "nx,ny,x,y,z\n1,2,3\n"})
    expectRefused("csv", other, "columns, the header names");
  const std::string brackets(1 << 20, '('); // looked at once
  expectRefused("csv", brackets + "\n1,2,3\n", "nor names columns");
  for (const char* header : {"a,b,c", "lat,lon,alt"})
    expectRefused("csv", header + std::string("\n1,2,3\n"),
                  "line 1: is not a row of numbers, nor names columns x, y and z, which are lengths: name them so");
  std::string wide = "1 2"; // in no time that grows with its square
  for (int column = 2; column < 200000; ++column)
    wide += " -7";
  EXPECT_EQ(parse("xyz", wide + "\n").scalars.size(), 199997u);
  EXPECT_EQ(parse("csv", "x,y,z,a,a\n1,2,3,4,5\n").scalars.at("a"), std::vector<float>{4}) << "the first counts";
  expectRefused("csv", "x,y,z\n1,2,3\nx,y,z\n", "line 3: column 1 'x' holds 'x', which is no number");
  expectRefused("csv", "x,y,z\n\"0,5\",\"1,5\",\"2,5\"\n", "line 2: column 1 'x' holds '0,5', which is no number");
}

TEST(PointReader, coordinatesAreNamedWithTheirFrameOrUnit)
{
  for (const std::string pattern : {"px", "p_x", "x_m", "world_x", "pos_x", "posX", "Position.X", "world x m",
                                    "x-coord", "X COORDINATE", "x_ft", "map.x", "point x [m]"}) {
    SCOPED_TRACE(pattern);
    const auto named = [&](const std::string& to) { return std::regex_replace(pattern, std::regex("[xX]"), to); };
    const std::string header =
        "label," + named("Z") + "," + named("X") + "," + named("Y") + ",n_x,n_y,n_z,vel_x,x_vel\n";
    const PointTable table = parse("csv", header + "tree,3,1,2,0,0,1,7,8\n");
    EXPECT_EQ(table.positions, (Points{{1, 2, 3}}));
    EXPECT_EQ(table.normals, (Normals{{0, 0, 1}}));
    EXPECT_EQ(table.scalars, (std::map<std::string, std::vector<float>>{{"vel_x", {7}}, {"x_vel", {8}}}));
  }
  EXPECT_EQ(parse("csv", "easting_m,northing_m,Height m\n1,2,3\n").positions, (Points{{1, 2, 3}}));
  EXPECT_EQ(parse("ply", std::regex_replace(plyHeader(1, "ascii"), std::regex("double "), "double world.") + "1 2 3\n")
                .positions,
            (Points{{1, 2, 3}}));
  EXPECT_EQ(parse("csv", "world_x,world_y,world_z,x,y,z\n7,8,9,1,2,3\n").positions, (Points{{1, 2, 3}}))
      << "plain ones";
  EXPECT_EQ(parse("csv", "pos_x,map_x,map_y,map_z,pos_y,pos_z\n1,7,8,9,2,3\n").positions, (Points{{1, 2, 3}}))
      << "of one frame";
  for (const char* other :
       {"nx,ny,nz", "normal_x,normal_y,normal_z", "n_x,n_y,n_z", "NormalX,NormalY,NormalZ", "x_vel,y_vel,z_vel",
        "velocity.x,velocity.y,velocity.z", "sensor_x,sensor_y,sensor_z", "scanner.x,scanner.y,scanner.z",
        "sigma_x,sigma_y,sigma_z", "color_x,color_y,color_z", "red,green,blue", "m_x,m_y,m_z", "pos_x,map_y,map_z",
        "x_m,y_m,z_ft", "pos,pos,pos", "_,_,_"})
    expectRefused("csv", other + std::string("\n1,2,3\n"),
                  "nor names columns x, y and z, which are lengths: name them");
}

TEST(XyzReader, columnsOfTextAreSkippedWithANote)
{
  const std::string skipped = " is skipped: line 2 holds 'old tree', which is no number";
  const std::vector<std::array<std::string, 2>> cases = {
      {"x,y,z,label,red,green,blue\n1,2,3,old tree,10,20,30\n4,5,6,,40,50,60\n,,,,,,\n", "column 4 'label'" + skipped},
      {"label;x;y;z;red;green;blue;\n\"old tree\";1;2;3;10;20;30;\n7;4;5;6;40;50;60\n", "column 1 'label'" + skipped},
      {"# exported\nold tree\t1\t2\t3\t10\t20\t30\n\t4\t5\t6\t40\t50\t60\n", "column 1" + skipped},
      {"label,x,y,z,red,green,blue\n\"old tree\",1,2,3,10,20,30\n\"pine; small, 5 m\",4,5,6,40,50,60\n",
       "column 1 'label'" + skipped},
      {"\"x\" \"y\" \"z\" \"red\" \"green\" \"blue\"\n\"a\" 1 2 3 10 20 30\n\"b\" 4 5 6 40 50 60\n",
       "column 1 is skipped: line 2 holds 'a', which is no number"}};
  for (const auto& [text, note] : cases) {
    SCOPED_TRACE(text);
    const PointTable table = parse("csv", text);
    EXPECT_EQ(table.positions, (Points{{1, 2, 3}, {4, 5, 6}}));
    EXPECT_EQ(table.colors, (std::vector<Color>{{10, 20, 30}, {40, 50, 60}}));
    EXPECT_TRUE(table.scalars.empty());
    EXPECT_EQ(table.notes.front(), note);
  }
}

TEST(XyzReader, emptyCellsMatterWhereTheyAreRead)
{
  for (const std::string header : {"x,y,z,quality,nx,ny,nz\n", ""}) {
    const PointTable table = parse("csv", header + "1,2,3,,0,0,1\n4,5,6,.5,,,\n7,8,9, ,0,0,1\n1,1,1,2,0,0,1\n");
    EXPECT_EQ(table.size(), 4u);
    if (!header.empty()) {
      EXPECT_TRUE(std::isnan(table.normals[1].x()));
      EXPECT_TRUE(std::isnan(table.scalars.at("quality")[0]));
      EXPECT_EQ(table.scalars.at("quality")[1], .5);
    }
  }
  EXPECT_EQ(parse("csv", ",1,2,3,\n,4,5,6,\n").positions.at(1), Eigen::Vector3d(4, 5, 6));
  expectRefused("csv", "1,2,3,0,0,1\n4,5,6.7.8,0,0,1\n",
                "line 2: column 3 holds '6.7.8', which is no number such as -0.5: correct it, or delete the line");
  expectRefused("csv", "x,y,z,nx,ny,nz\n1,2,3,0,O,1\n", "line 2: column 5 'ny' holds 'O', which is no number");
}

// As with NaN in other formats: the library counts such points, so that views and other columns keep their rows.
TEST(XyzReader, pointsWithoutACoordinateAreLeftOutWithAWarning)
{
  for (const char* word : {"", "NA", "n/a", "null", "None", "-", "#N/A", "#DIV/0!", "-1.#IND", "1.#QNAN0"})
    for (const std::string header : {"x,y,z,quality\n", ""}) {
      SCOPED_TRACE(header + word);
      const PointTable table =
          parse("csv", header + "1,2,3,4\n5," + word + ",6,7\n8,9," + word + ",1\n1,1,2," + word + "\n");
      ASSERT_EQ(table.size(), 4u);
      EXPECT_TRUE(std::isnan(table.positions[1].y()) && std::isnan(table.positions[2].z()));
      EXPECT_EQ(table.positions[3], Eigen::Vector3d(1, 1, 2));
      EXPECT_TRUE(std::isnan(table.scalars.at(header.empty() ? "intensity" : "quality")[3]));
      EXPECT_EQ(table.warnings, std::vector<std::string>{"2 points have no number as a coordinate, in line " +
                                                         std::string(header.empty() ? "2" : "3") + " first: left out"});
    }
  EXPECT_EQ(parse("xyz", "1 2 3\nNA NA NA\n").warnings.front(),
            "1 point has no number as a coordinate, in line 2: left out");
  // In the first row, too, which is none of names.
  for (const std::string row : {"NA NA NA", "NA,NA,NA", "nan nan nan", "1,NA,3", "N/A;2;3", ",2,3"}) {
    const PointTable table = parse("txt", row + "\n4 5 6\n7 8 9\n");
    EXPECT_EQ(table.size(), 3u) << row;
    EXPECT_TRUE(table.positions.at(0).hasNaN()) << row;
    EXPECT_EQ(table.positions.at(2), Eigen::Vector3d(7, 8, 9)) << row;
  }
  for (const char* text : {"NA NA NA\n", "NA,2,3\n,5,6\n"})
    expectRefused("txt", text, "has fewer than three columns with numbers, as x y z are");
  expectRefused("csv", "x,y,z\n1,NA,3\n4,NA,6\n", "column 2 'y' holds no number");
  EXPECT_EQ(mrf_apps::joinPoints({parse("csv", "1,2,3\n"), parse("csv", "1,2,3\n4,5,\n")}, {"a.csv", "b.csv"}).warnings,
            std::vector<std::string>{"'b.csv': 1 point has no number as a coordinate, in line 2: left out"});
}

TEST(XyzReader, coordinatesHaveOneUnit)
{
  for (const char* header : {"X [mm],Y [mm],Z [m]", "\"X [mm]\";\"Y [mm]\";\"Z [m]\"", "# X(mm) Y(mm) Z(m)",
                             "Easting [mm], Northing [mm], Elevation [ m ]"})
    expectRefused("csv", header + std::string("\n1,2,3\n"), "line 1: has coordinates in m and in mm: give all in one");
  expectRefused("csv", "X [US ft],Y [US ft],Z [m]\n1,2,3\n", "in US ft and in m");
  for (const char* header : {"X [m],Y [m],Z [m],Range [mm]", "X [m],Y [m],Z,Nx [mm]", "X (E),Y (N),Z (up),Z [mm]"})
    EXPECT_EQ(parse("csv", header + std::string("\n1,2,3,4\n")).size(), 1u) << header;
  // Longer than what a regular expression has a stack for.
  const std::string blanks(60000, ' ');
  expectRefused("csv", "x" + blanks + "[m],y [mm],z\n1,2,3\n", "in m and in mm");
  expectRefused("csv", "x [" + blanks + "m],y [mm],z\n1,2,3\n", "the header names");
}

TEST(XyzReader, heightsHaveManyNames)
{
  for (const char* header : {"Easting,Northing,Orthometric Height", "North,East,Elev", "Rechtswert,Hochwert,Hoehe",
                             "Easting,Northing,RL", "East,North,Up", "X,Y,Elevation"})
    EXPECT_EQ(parse("csv", header + std::string("\n1,2,3\n")).positions.at(0).z(), 3) << header;
}

TEST(XyzReader, aGridOfHeightsIsNamed)
{
  expectRefused("asc", "ncols 2\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n3 4\n",
                "line 1: begins a grid of heights");
}

TEST(XyzReader, aColumnThatNumbersThePointsIsSkipped)
{
  const auto numbered = [](const std::string& header, std::size_t count, std::size_t first) {
    const Points points = surveyPlane();
    std::string text = header;
    for (std::size_t i = 0; i < count; ++i)
      text += std::to_string(first + i) + "," + rows({points[i]}, {}, {}, ",");
    return parse("csv", text);
  };
  for (const std::size_t first : {0, 1, 101})
    for (const char* header : {"", ",x,y,z\n", "x y z\n"}) {
      SCOPED_TRACE(header);
      const PointTable table = numbered(header, 20, first);
      EXPECT_EQ(table.positions[19], surveyPlane()[19]);
      EXPECT_TRUE(table.scalars.empty());
      EXPECT_EQ(table.notes, std::vector<std::string>{"column 1 numbers the points, or has their times: skipped"});
    }
  const PointTable named = numbered("id,x,y,z\n", 20, 5);
  EXPECT_EQ(named.positions[19], surveyPlane()[19]);
  EXPECT_EQ(named.scalars.at("id").at(19), 24);
  EXPECT_EQ(numbered("", 3, 0).positions[2].x(), 2) << "of three rows it may be a coordinate";
  std::string gaps; // some were left out, and they are counted in tens
  for (std::size_t i = 0; i < 20; ++i)
    gaps += std::to_string(10 * i + (i > 7 ? 30 : 0)) + " " + rows({surveyPlane()[i]}, {}, {}, " ");
  EXPECT_EQ(parse("txt", gaps).positions[19], surveyPlane()[19]);
  const PointTable frame = numbered(",0,1,2\n", 20, 0); // whose columns have no names
  EXPECT_EQ(frame.size(), 20u);
  EXPECT_EQ(frame.positions[19], surveyPlane()[19]);
  std::string timed; // two points at each time, in seconds since 1970
  for (std::size_t i = 0; i < 20; ++i)
    timed += std::to_string(1.6e9 + .05 * static_cast<double>(i / 2)) + " " + rows({surveyPlane()[i]}, {}, {}, " ");
  EXPECT_EQ(parse("txt", timed).positions[19], surveyPlane()[19]);
}

TEST(PtsReader, scansBeginWithTheirCounts)
{
  const PointTable table = parse("pts", "2\n1 2 3 -1000 10 20 30\n4 5 6 7 40 50 60\n1\n7 8 9 0 70 80 90\n");
  EXPECT_EQ(table.positions, (Points{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
  EXPECT_EQ(table.scalars.at("intensity"), (std::vector<float>{-1000, 7, 0}));
  EXPECT_EQ(table.colors.at(2), (Color{70, 80, 90}));
  EXPECT_EQ(parse("pts", "1\n1 2 3 200 10 20 30\n").colors.at(0)[0], 10) << "a count tells what is first";
  for (const std::string intensity : {"200", "0", "-2048", "2047", "0.5"}) {
    SCOPED_TRACE(intensity);
    const PointTable uncounted = parse("pts", "1 2 3 " + intensity + " 10 20 30\n"),
                     dark = parse("pts", "1 2 3 " + intensity + " 0 0 0\n");
    EXPECT_EQ(uncounted.colors.at(0), (Color{10, 20, 30})) << "and so does the format";
    EXPECT_TRUE(dark.colors.empty() && dark.normals.empty()) << "of a scanner without a camera";
    for (const PointTable& other : {uncounted, dark})
      EXPECT_EQ(other.scalars.at("intensity").at(0), std::stof(intensity));
  }
  expectRefused("pts", "1 2 3 200 10 20 30\n1\n", "line 2: has 1 columns, those before have 7");
  EXPECT_EQ(parse("pts", "1\n1 2 3 -7\n").scalars.at("intensity").at(0), -7);
  expectRefused("pts", "2\n1 2 3 0\n1\n4 5 6 0\n", "announces 3 points and holds 2");
}

TEST(XyzReader, valuesAndTheFormatTellTheColumns)
{
  const PointTable scalarFirst = parse("xyz", "1 2 3 200 0 .6 .8\n4 5 6 7 0 1 0\n");
  EXPECT_EQ(scalarFirst.scalars.at("intensity"), (std::vector<float>{200, 7}));
  EXPECT_EQ(scalarFirst.normals, (std::vector<Eigen::Vector3f>{{0, .6f, .8f}, {0, 1, 0}}));
  const PointTable shares = parse("xyzrgb", "1 2 3 1 0 0.2\n4 5 6 0 1 0\n");
  EXPECT_EQ(shares.colors, (std::vector<Color>{{255, 0, 51}, {0, 255, 0}}));
  EXPECT_TRUE(shares.normals.empty() && shares.scalars.empty());
  EXPECT_EQ(parse("xyzrgb", "1 2 3 1 0 20\n").colors.at(0), (Color{1, 0, 20}));
  EXPECT_EQ(parse("xyzn", "1 2 3 0 1 0\n").normals.at(0), Eigen::Vector3f::UnitY());
}

TEST(PtxReader, scansAreMovedToWhereTheyBelong)
{
  // A quarter turn about z, row vectors from the left.
  const auto scan = [](const std::string& size, const std::string& scanner, const std::string& cells) {
    return size + scanner + "0 1 0\n-1 0 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n431000.5 4500000.25 100 1\n" + cells;
  };
  const std::string at = "431000.5 4500000.25 100\n", cells = "1 2 3 .5\n0 0 0 .5\n";
  const PointTable one = parse("ptx", scan("2\n1\n", at, cells) + "\n\n");
  EXPECT_EQ(one.positions, (Points{{430998.5, 4500001.25, 103}})) << "0 0 0 is no point";
  EXPECT_EQ(one.scalars.at("intensity"), std::vector<float>{.5});
  EXPECT_EQ(one.sensorOrigin, Eigen::Vector3d(431000.5, 4500000.25, 100));
  EXPECT_EQ(parse("ptx", scan("1\n2\n", "0 0 0\n", cells)).sensorOrigin, one.sensorOrigin)
      << "where the transformation has it";
  const PointTable two = parse("ptx", scan("1\n1\n", at, "1 2 3 .5 9 8 7\n") + scan("1\n1\n", at, "4 5 6 1 3 2 1\r\n"));
  EXPECT_EQ(two.positions.at(1), Eigen::Vector3d(430995.5, 4500004.25, 106));
  EXPECT_EQ(two.colors.at(1), (Color{3, 2, 1}));
  EXPECT_FALSE(two.sensorOrigin) << "there are two";
  EXPECT_EQ(two.sensors, (Points(2, {431000.5, 4500000.25, 100})));
  EXPECT_EQ(two.views, (std::vector<std::int32_t>{0, 1}));
  const PointTable empty = parse("ptx", scan("1\n1\n", at, "0 0 0 .5\n") + scan("2\n1\n", "7 8 9\n", cells));
  EXPECT_EQ(empty.views, std::vector<std::int32_t>{1}) << "the first scan saw nothing";
  EXPECT_EQ(empty.sensors.at(1), Eigen::Vector3d(7, 8, 9));

  expectRefused("ptx", scan("2\n1\n", at, "1 2 3 .5\n"), "truncated");
  expectRefused("ptx", scan("2000000000\n2000000000\n", at, cells), "truncated");
  expectRefused("ptx", scan("2\n1\n", at, cells) + "2\n", "truncated");
  expectRefused("ptx", scan("2\n-1\n", at, cells), "line 2: is not what the header of a scan has here: a count");
  expectRefused("ptx", scan("2\n1\n", "0 0\n", cells), "line 3: is not what the header of a scan has here: 3 numbers");
  expectRefused("ptx", scan("2\n1\n", "0 0 nan\n", cells), "line 3");
  expectRefused("ptx", scan("2\n1\n", at, "1 2 3 .5\n1 2 3 .5 9 8 7\n"), "line 12: is not a cell");
  expectRefused("ptx", scan("1\n1\n", at, "1 2 3 x\n"), "line 11: is not a row of numbers");
  expectRefused("ptx", scan("1\n1\n", at, "0 0 0 .5\n"), "holds no points");
}

TEST(PlyReader, colorsOfEveryTypeAndName)
{
  const auto colors = [](const std::string& type, const std::string& prefix, const std::string& rgb) {
    std::string channels;
    for (const std::string channel : {"red", "green", "blue"})
      channels += "property " + type + " " + prefix + channel + "\n";
    const PointTable table = parse("ply", plyHeader(2, "ascii", channels) + "0 0 0 " + rgb + "\n1 0 0 0 0 0\n");
    EXPECT_TRUE(table.scalars.empty());
    return table.colors;
  };
  const std::vector<Color> expected = {{255, 100, 1}, {0, 0, 0}};
  EXPECT_EQ(colors("ushort", "", "65535 25700 257"), expected);
  EXPECT_EQ(colors("ushort", "", "255 100 1"), expected) << "bytes in a wider type";
  EXPECT_EQ(colors("uchar", "diffuse_", "255 100 1"), expected);
  EXPECT_EQ(colors("float", "", "1 .39216 .0039"), expected);
  EXPECT_EQ(colors("uchar", "", "1 1 1").at(0)[0], 1) << "a dark byte is no share";
}

TEST(PointReader, decimalCommasAreNoSeparators)
{
  for (const std::string row : {"0,5 1,25 -2,0", "0,5;1,25;-2,0", "0,5\t1\t2", "1 2 3 0,5"})
    expectRefused("xyz", "# scan\n" + row + "\n", "line 2: has commas within numbers");
  expectRefused("obj", "v 0 0 0\nv 0,5 1,25 -2,0\n", "line 2");
  expectRefused("off", "OFF\n1 0 0\n0,5 1,25 -2,0\n", "line 3");
  expectRefused("ply", plyHeader(1, "ascii") + "0,5 1,25 -2,0\n");
  expectRefused("pcd", pcdHeader(1, "8 8 8", "ascii") + "0,5 1,25 -2,0\n", "is not a row of 3 numbers");
  for (const std::string row : {"0.5,1,2", "0.5, 1, 2", "0.5 ,1,2", "0.5 1 2", "0.5;1;2"})
    EXPECT_EQ(parse("xyz", row + "\n").positions.front(), Eigen::Vector3d(.5, 1, 2)) << row;
}

TEST_F(PointReaders, devicesAreNoFiles)
{
  EXPECT_THROW(readMesh("/dev/zero"), UsageError);
  std::filesystem::create_symlink("/dev/zero", path("endless.ply"));
  EXPECT_THROW(readPoints(path("endless.ply").string()), FileError);
}

TEST(PointReader, offHasVerticesWithNormalsAndColors)
{
  const auto read = [](const std::string& text) { return parse("off", text); };
  const PointTable plain = read("OFF # a triangle\n3 1 0\n0 0 0\n\n431000.25 0 0\n# between\n0 1 0\n3 0 1 2\n");
  ASSERT_EQ(plain.size(), 3u);
  EXPECT_EQ(plain.positions[1], Eigen::Vector3d(431000.25, 0, 0));
  EXPECT_TRUE(plain.normals.empty() && plain.colors.empty());
  const PointTable all = read("CNOFF\n2 0 0\n0 0 0 0 0 1 255 128 0\n1 0 0 0 1 0 1 2 3\n");
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all.normals[1], Eigen::Vector3f(0, 1, 0));
  EXPECT_EQ(all.colors[0], (Color{255, 128, 0}));
  EXPECT_EQ(all.colors[1], (Color{1, 2, 3}));
  const PointTable shares = read("COFF 1 0\n0 0 0 1 .5 0 1\n");
  EXPECT_EQ(shares.colors.at(0), (Color{255, 128, 0}));
  // A mesh that is cut off among its faces has all its points.
  EXPECT_EQ(read("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").size(), 3u);
  EXPECT_THROW(parseMesh("off", "file", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), FileError);
  for (const char* bad : {"OFF\n3 0 0\n0 0 0\n1 0 0\n", "NOFF\n1 0 0\n0 0 0\n", "OFF BINARY\n", "OOFF\n1 0 0\n0 0 0\n",
                          "OFF\n0 0 0\n", "OFF\n-1 0 0\n0 0 0\n"})
    EXPECT_THROW(read(bad), FileError) << bad;
}

TEST(PointReader, formatsAreKnownByTheirBeginnings)
{
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"ply\nformat ascii 1.0\n", "ply"},
      {"ply\r\nformat", "ply"},
      {"# .PCD v0.7 - Point Cloud Data file format\n", "pcd"},
      {"# by hand\nVERSION .7\n", "pcd"},
      {"FIELDS x y z\n", "pcd"},
      {"OFF\n", "off"},
      {"# comment\n\nCNOFF 3 1 0\n", "off"},
      {"mtllib a.mtl\nv 0 0 0\n", "obj"},
      {"\xef\xbb\xbfv 0 0 0\n", "obj"},
      {"// scanner 7\n1.5,2,3\n", "xyz"},
      {"X Y Z intensity\n", "xyz"},
      {"12\n", "xyz"},
      {"12\n1 2 3 -7\n", "xyz"},
      {",x,y,z\n", "xyz"},
      {"12\n5\n0 0 0\n", "ptx"},
      {std::string("LASF\0\0", 6), "las"},
      {"", ""},
      {"# nothing else\n", ""},
      {"solid cube\n", ""},
      {"<?xml version=\"1.0\"?>\n", ""},
      {std::string("\0\0\0", 3), ""}};
  for (const auto& [text, format] : cases)
    EXPECT_EQ(pointFormatOf(text), format) << text;
}

TEST(LasReader, everyFormatOfEveryVersion)
{
  const Points positions = {{430999.99, 4500000.02, 100.03}, {431000.04, 4500000.05, 99.94}};
  for (const auto& [minor, formats] : {std::pair(2, 4), std::pair(3, 6), std::pair(4, 11)})
    for (int format = 0; format < formats; ++format) {
      SCOPED_TRACE("1." + std::to_string(minor) + ", format " + std::to_string(format));
      const PointTable table = parse("las", lasFile(minor, static_cast<std::size_t>(format), twoPoints));
      ASSERT_EQ(table.size(), 2u);
      for (std::size_t i = 0; i < 2; ++i)
        EXPECT_LT((table.positions[i] - positions[i]).norm(), 1e-8);
      EXPECT_FALSE(table.areFloats);
      EXPECT_EQ(table.scalars.at("intensity"), (std::vector<float>{65535, 7}));
      if (std::set<int>{2, 3, 5, 7, 8, 10}.count(format) > 0)
        EXPECT_EQ(table.colors, (std::vector<Color>{{1, 2, 255}, {0, 0, 3}}));
      else
        EXPECT_TRUE(table.colors.empty());
    }
  // Bytes where 16 bits are meant are bytes; zeros everywhere are none.
  const auto pointOf = [](std::uint16_t intensity, std::array<std::uint16_t, 3> color) {
    return parse("las", lasFile(2, 2, {{{1, 2, 3}, intensity, color}}));
  };
  EXPECT_EQ(pointOf(0, {10, 20, 200}).colors.at(0), (Color{10, 20, 200}));
  EXPECT_TRUE(pointOf(0, {10, 20, 200}).scalars.empty());
  EXPECT_TRUE(pointOf(5, {0, 0, 0}).colors.empty());
}

TEST(LasReader, pointsWithheldOrClassifiedAsNoiseAreSkipped)
{
  const std::string withheld = "1 points are marked as withheld: skipped",
                    noise = "1 points are classified as noise: skipped", kept;
  const std::size_t begin = 375 + 7 + 15; // of the first point's class and flags
  for (const auto& [format, at, value, note] : {std::tuple(1U, 0U, 128, withheld),
                                                {6, 0, 4, withheld},
                                                {1, 0, 4, kept}, // the flag of the other formats
                                                {6, 0, 128, kept},
                                                {1, 0, 7, noise},
                                                {1, 0, 7 | 64, noise},
                                                {6, 1, 7, noise},
                                                {6, 1, 18, noise},
                                                {1, 0, 18, kept},
                                                {1, 1, 7, kept},
                                                {6, 1, 2, kept},
                                                {6, 1, 7 | 64, kept}}) {
    SCOPED_TRACE("format " + std::to_string(format) + ", " + std::to_string(value));
    std::string bytes = lasFile(4, format, twoPoints);
    put(bytes, begin + at, static_cast<std::uint8_t>(value));
    const PointTable table = parse("las", bytes);
    EXPECT_EQ(table.scalars.at("intensity"), note.empty() ? std::vector<float>({65535, 7}) : std::vector<float>{7});
    EXPECT_EQ(table.notes, note.empty() ? std::vector<std::string>() : std::vector<std::string>{note});
  }
}

TEST_F(PointReaders, heightsThatStandForNoDataAreSkipped)
{
  const PointTable table = parse("xyz", "0 0 1.5\n0 1 -9999\n1 0 -3\n");
  EXPECT_TRUE(table.positions[1].array().isNaN().all());
  EXPECT_EQ(table.positions[2].z(), -3);
  EXPECT_EQ(table.notes, std::vector<std::string>{"1 points have the height -9999, which stands for no data: skipped"});
  const PointTable deep = parse("xyz", "0 0 -8000\n0 1 -9999\n1 0 -9998\n");
  EXPECT_EQ(deep.positions[1].z(), -9999) << "which is one of the heights there";
  EXPECT_TRUE(deep.notes.empty());
}

TEST(LasReader, headersAreNotBelieved)
{
  const std::string good = lasFile(4, 7, twoPoints);
  const auto refused = [&](std::size_t at, auto value, const std::string& words) {
    std::string bytes = good;
    put(bytes, at, value);
    expectRefused("las", bytes, "'file.las': " + words);
  };
  refused(0, 'X', "is not a LAS file");
  refused(24, std::uint8_t{2}, "is of LAS 2.4; versions 1.0 to 1.4 are read");
  refused(25, std::uint8_t{5}, "is of LAS 1.5");
  refused(94, std::uint16_t{227}, "is a malformed LAS file: points from byte 382 on, and a header of 227");
  refused(96, std::uint32_t{300}, "is a malformed LAS file: points from byte 300");
  refused(96, std::uint32_t{4294967295}, "is truncated: it declares 2 points and holds 0");
  refused(104, std::uint8_t{11}, "has points of format 11; 0 to 10 are read");
  refused(104, std::uint8_t{0x87}, "is compressed, as LAZ is; laszip -i 'file.las' -o cloud.las");
  refused(104, std::uint8_t{10}, "is a malformed LAS file: points of format 10 take 67 bytes at least, not 37");
  refused(105, std::uint16_t{0}, "is a malformed LAS file: points of format 7 take 36 bytes at least, not 0");
  refused(107, std::uint32_t{3}, "is truncated: it declares 3 points and holds 2");
  refused(247, std::uint64_t{0} - 1, "is truncated: it declares 9000000000000000000 points and holds 2");
  refused(247, std::uint64_t{0}, "holds no points");
  refused(131, 0., "is a malformed LAS file: a scale");
  refused(171, std::nan(""), "is a malformed LAS file: a scale or an offset is no number");
  for (const std::size_t size : {4, 226, 227, 374, 375, 400})
    expectRefused("las", good.substr(0, size), "is truncated");
}

TEST(PointReader, warnsOfFilesFarApart)
{
  const auto table = [](double x) {
    PointTable result;
    result.positions = {{x, 0, 0}, {x + 1, 1, 0}};
    return result;
  };
  EXPECT_TRUE(joinPoints({table(0), table(50)}, {"a.ply", "b.ply"}).warnings.empty());
  const std::vector<std::string> warnings =
      joinPoints({table(0), table(1), table(4.5e6)}, {"a.ply", "b.ply", "c.ply"}).warnings;
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings.front().find("'c.ply' is 4499998 away from the files before it"), 0u) << warnings.front();
}

TEST(PointReader, joinsWhatAllFilesHave)
{
  const auto table = [](int points) {
    PointTable result;
    result.positions.assign(static_cast<std::size_t>(points), Eigen::Vector3d(points, 4.5e6 + .01, 0));
    return result;
  };
  PointTable full = table(2), plain = table(1), scans = table(2);
  full.normals.assign(2, Eigen::Vector3f::UnitX());
  full.colors.assign(2, {1, 2, 3});
  full.scalars = {{"intensity", {1, 2}}, {"quality", {3, 4}}, {"time", {5, 6}}};
  full.sensorOrigin = Eigen::Vector3d(0, 0, 9);
  full.notes = {"column 1 numbers the points, or has their times: skipped"};
  plain.scalars = {{"quality", {7}}};
  plain.sensorOrigin = Eigen::Vector3d(0, 0, 5);
  scans.scalars = {{"quality", {8, 9}}, {"time", {8, 9}}};
  scans.sensors = {Eigen::Vector3d(0, 0, 7), Eigen::Vector3d(0, 0, 9)};
  scans.views = {1, 0};

  const PointTable alone = joinPoints({full}, {"full.xyz"});
  EXPECT_EQ(alone.scalars, full.scalars);
  EXPECT_EQ(alone.notes, full.notes);
  EXPECT_EQ(alone.sensorOrigin, full.sensorOrigin);

  const PointTable whole = joinPoints({full, plain, scans}, {"full.xyz", "plain.pcd", "scans.ptx"});
  Points positions = full.positions;
  for (const PointTable* more : {&plain, &scans})
    positions.insert(positions.end(), more->positions.begin(), more->positions.end());
  EXPECT_EQ(whole.positions, positions);
  EXPECT_TRUE(whole.normals.empty());
  EXPECT_TRUE(whole.colors.empty());
  EXPECT_EQ(whole.scalars, (decltype(whole.scalars){{"quality", {3, 4, 7, 8, 9}}}));
  EXPECT_EQ(whole.sensors, (Points{{0, 0, 9}, {0, 0, 5}, {0, 0, 7}}));
  EXPECT_EQ(whole.views, (std::vector<std::int32_t>{0, 0, 1, 0, 2}));
  EXPECT_EQ(whole.notes,
            (std::vector<std::string>{"full.xyz: column 1 numbers the points, or has their times: skipped"}));
  EXPECT_EQ(whole.warnings,
            (std::vector<std::string>{"'plain.pcd' has no normals: those of the other files are left out",
                                      "'plain.pcd' has no colors: those of the other files are left out",
                                      "'plain.pcd' has no intensities: those of the other files are left out"}));
  const PointTable colored = joinPoints({full, full}, {"a.xyz", "b.xyz"});
  EXPECT_EQ(colored.normals.size(), 4u);
  EXPECT_EQ(colored.colors.size(), 4u);
  EXPECT_TRUE(colored.warnings.empty());
}

TEST_F(PointReaders, whatGzipPackedIsReadLikeTheRest)
{
  const std::string rows = tool::sphereRows(400);
  write("rows.xyz", rows);
  write("two.LAS", lasFile(3, 3, twoPoints));
  const auto shell = [&](const std::string& line) {
    ASSERT_EQ(tool::runProgram({"sh", "-c", line}, path("")).status, 0) << line;
  };
  shell("gzip -k rows.xyz two.LAS && cp rows.xyz plain.xyz.gz && (gzip -c rows.xyz; gzip -c rows.xyz) > twice.xyz.gz");
  const auto read = [&](const std::string& name) { return readPoints(path(name).string()); };
  EXPECT_EQ(read("rows.xyz.gz").positions, read("rows.xyz").positions);
  EXPECT_EQ(read("two.LAS.gz").colors, read("two.LAS").colors);
  EXPECT_EQ(read("plain.xyz.gz").size(), 400u) << "a browser has unpacked it already";
  EXPECT_EQ(read("twice.xyz.gz").size(), 800u) << "as cat joins them";
  succeed({"rows.xyz.gz", "--output-directory", "meshes", "-q"});
  EXPECT_TRUE(std::filesystem::exists(path("meshes/rows.ply")));

  const std::string packed = tool::readText(path("rows.xyz.gz"));
  const auto unpack = [](const std::string& bytes, std::size_t limit) { return unpackGzip("a.gz", bytes, limit); };
  EXPECT_EQ(unpack(packed, rows.size()), rows);
  expectRefusedBy([&] { unpack(packed, rows.size() - 1); },
                  "'a.gz': unpacks to more than 0 MiB, an eighth of the free");
  for (const std::size_t size : {3UL, 12UL, packed.size() / 2, packed.size() - 1})
    expectRefusedBy([&] { unpack(packed.substr(0, size), 1 << 20); }, "'a.gz': is truncated");
  std::string damaged = packed;
  damaged[packed.size() / 2] ^= 1;
  expectRefusedBy([&] { unpack(damaged, 1 << 20); }, "'a.gz': is a corrupt file of gzip");
  expectRefusedBy([&] { unpack(packed + "abc", 1 << 20); }, "other bytes follow");
  write("damaged.xyz.gz", damaged);
  expectFailure({"damaged.xyz.gz", "out.ply"}, 1, "'damaged.xyz.gz': is a corrupt file of gzip; copy it anew");
  expectFailure({"scan.laz.gz", "out.ply"}, 2, "laszip -i");
}

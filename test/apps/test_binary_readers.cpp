// SPDX-License-Identifier: BSD-3-Clause
// LAS files, and files that gzip has packed.
#include "support/errors.h"
#include "support/gzip.h"
#include "support/point_table.h"
#include "support/tool.h"

#include <array>
#include <cstring>

using namespace mrf_apps;

namespace {

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

/// Steps of 1 cm from 431000, 4500000, 100; the numbers are those of the specification.
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

template <typename Read>
void expectRefused(const Read& read, const std::string& words)
{
  try {
    read();
    ADD_FAILURE() << "was read: " << words;
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
  }
}

class BinaryReaders : public tool::Test {};

} // namespace

TEST(LasReader, everyFormatOfEveryVersion)
{
  const std::vector<Eigen::Vector3d> positions = {{430999.99, 4500000.02, 100.03}, {431000.04, 4500000.05, 99.94}};
  for (const auto& [minor, formats] : {std::pair(2, 4), std::pair(3, 6), std::pair(4, 11)})
    for (int format = 0; format < formats; ++format) {
      SCOPED_TRACE("1." + std::to_string(minor) + ", format " + std::to_string(format));
      const PointTable table = parsePoints("las", "a.las", lasFile(minor, static_cast<std::size_t>(format), twoPoints));
      ASSERT_EQ(table.size(), 2u);
      for (std::size_t i = 0; i < 2; ++i)
        EXPECT_LT((table.positions[i] - positions[i]).norm(), 1e-8);
      EXPECT_FALSE(table.areFloats);
      EXPECT_EQ(table.scalars.at("intensity"), (std::vector<float>{65535, 7}));
      if (std::set<int>{2, 3, 5, 7, 8, 10}.count(format) > 0)
        EXPECT_EQ(table.colors, (std::vector<std::array<std::uint8_t, 3>>{{1, 2, 255}, {0, 0, 3}}));
      else
        EXPECT_TRUE(table.colors.empty());
    }
  // Bytes where 16 bits are meant are bytes; zeros everywhere are none.
  const auto pointOf = [](std::uint16_t intensity, std::array<std::uint16_t, 3> color) {
    return parsePoints("las", "a.las", lasFile(2, 2, {{{1, 2, 3}, intensity, color}}));
  };
  EXPECT_EQ(pointOf(0, {10, 20, 200}).colors.at(0), (std::array<std::uint8_t, 3>{10, 20, 200}));
  EXPECT_TRUE(pointOf(0, {10, 20, 200}).scalars.empty());
  EXPECT_TRUE(pointOf(5, {0, 0, 0}).colors.empty());
}

TEST(LasReader, withheldPointsAreSkipped)
{
  const std::size_t begin = 375 + 7 + 15; // of the first point's flags
  for (const auto& [format, bit] : {std::pair(1, 128), std::pair(6, 4)}) {
    std::string bytes = lasFile(4, static_cast<std::size_t>(format), twoPoints);
    put(bytes, begin, static_cast<std::uint8_t>(bit));
    const PointTable table = parsePoints("las", "a.las", bytes);
    EXPECT_EQ(table.size(), 1u);
    EXPECT_EQ(table.scalars.at("intensity").at(0), 7);
    EXPECT_EQ(table.notes, std::vector<std::string>{"1 points are marked as withheld: skipped"});
    put(bytes, begin, static_cast<std::uint8_t>(132 - bit)); // another meaning here
    EXPECT_EQ(parsePoints("las", "a.las", bytes).size(), 2u);
  }
}

TEST(LasReader, headersAreNotBelieved)
{
  const std::string good = lasFile(4, 7, twoPoints);
  const auto refused = [&](std::size_t at, auto value, const std::string& words) {
    std::string bytes = good;
    put(bytes, at, value);
    expectRefused([&] { parsePoints("las", "a.las", bytes); }, "'a.las': " + words);
  };
  refused(0, 'X', "is not a LAS file");
  refused(24, std::uint8_t{2}, "is of LAS 2.4; versions 1.0 to 1.4 are read");
  refused(25, std::uint8_t{5}, "is of LAS 1.5");
  refused(94, std::uint16_t{227}, "is a malformed LAS file: points from byte 382 on, and a header of 227");
  refused(96, std::uint32_t{300}, "is a malformed LAS file: points from byte 300");
  refused(96, std::uint32_t{4294967295}, "is truncated: it declares 2 points and holds 0");
  refused(104, std::uint8_t{11}, "has points of format 11; 0 to 10 are read");
  refused(104, std::uint8_t{0x87}, "is compressed, as LAZ is; laszip -i 'a.las' -o cloud.las");
  refused(104, std::uint8_t{10}, "is a malformed LAS file: points of format 10 take 67 bytes at least, not 37");
  refused(105, std::uint16_t{0}, "is a malformed LAS file: points of format 7 take 36 bytes at least, not 0");
  refused(107, std::uint32_t{3}, "is truncated: it declares 3 points and holds 2");
  refused(247, std::uint64_t{0} - 1, "is truncated: it declares 9000000000000000000 points and holds 2");
  refused(247, std::uint64_t{0}, "holds no points");
  refused(131, 0., "is a malformed LAS file: a scale");
  refused(171, std::nan(""), "is a malformed LAS file: a scale or an offset is no number");
  for (const std::size_t size : {4, 226, 227, 374, 375, 400})
    expectRefused([&] { parsePoints("las", "a.las", good.substr(0, size)); }, "is truncated");
}

TEST_F(BinaryReaders, whatGzipPackedIsReadLikeTheRest)
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
  ASSERT_EQ(run({"rows.xyz.gz", "--output-directory", "meshes", "-q"}).status, 0);
  EXPECT_TRUE(std::filesystem::exists(path("meshes/rows.ply")));

  const std::string packed = tool::readText(path("rows.xyz.gz"));
  const auto unpack = [](const std::string& bytes, std::size_t limit) { return unpackGzip("a.gz", bytes, limit); };
  EXPECT_EQ(unpack(packed, rows.size()), rows);
  expectRefused([&] { unpack(packed, rows.size() - 1); }, "'a.gz': unpacks to more than 0 MiB, an eighth of the free");
  for (const std::size_t size : {3UL, 12UL, packed.size() / 2, packed.size() - 1})
    expectRefused([&] { unpack(packed.substr(0, size), 1 << 20); }, "'a.gz': is truncated");
  std::string damaged = packed;
  damaged[packed.size() / 2] ^= 1;
  expectRefused([&] { unpack(damaged, 1 << 20); }, "'a.gz': is a corrupt file of gzip");
  expectRefused([&] { unpack(packed + "abc", 1 << 20); }, "other bytes follow");
  write("damaged.xyz.gz", damaged);
  expectFailure({"damaged.xyz.gz", "out.ply"}, 1, "'damaged.xyz.gz': is a corrupt file of gzip; copy it anew");
  expectFailure({"scan.laz.gz", "out.ply"}, 2, "laszip -i");
}

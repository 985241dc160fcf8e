// PCD and PLY, through PCL.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/PCLPointCloud2.h>
#include <pcl/PolygonMesh.h>

#include <cmath>
#include <cstring>
#include <exception>
#include <functional>
#include <limits>

namespace mrf_apps {
namespace {

/// PCL's readers print several lines on a bad file; the tools print one of their own.
class QuietPcl {
public:
  QuietPcl() : level_(pcl::console::getVerbosityLevel()) { pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS); }
  ~QuietPcl() { pcl::console::setVerbosityLevel(level_); }
  QuietPcl(const QuietPcl&) = delete;
  QuietPcl& operator=(const QuietPcl&) = delete;

private:
  pcl::console::VERBOSITY_LEVEL level_;
};

template <typename T>
double valueAt(const std::uint8_t* bytes)
{
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<double>(value);
}

/// \return the function that reads one value of the field's type, null if there is none
double (*valueReader(std::uint8_t datatype))(const std::uint8_t*)
{
  switch (datatype) {
  case pcl::PCLPointField::INT8:
    return &valueAt<std::int8_t>;
  case pcl::PCLPointField::UINT8:
    return &valueAt<std::uint8_t>;
  case pcl::PCLPointField::INT16:
    return &valueAt<std::int16_t>;
  case pcl::PCLPointField::UINT16:
    return &valueAt<std::uint16_t>;
  case pcl::PCLPointField::INT32:
    return &valueAt<std::int32_t>;
  case pcl::PCLPointField::UINT32:
    return &valueAt<std::uint32_t>;
  case pcl::PCLPointField::FLOAT32:
    return &valueAt<float>;
  case pcl::PCLPointField::FLOAT64:
    return &valueAt<double>;
  default:
    return nullptr;
  }
}

/// The values of a field of a packed cloud; empty if it is not there or not a number per point.
std::vector<double> column(const pcl::PCLPointCloud2& cloud, const std::string& name)
{
  const std::size_t count = std::size_t{cloud.width} * cloud.height;
  for (const pcl::PCLPointField& field : cloud.fields) {
    const auto read = valueReader(field.datatype);
    if (field.name != name || read == nullptr || field.count > 1)
      continue;
    std::vector<double> values(count);
    for (std::size_t i = 0; i < count; ++i)
      values[i] = read(cloud.data.data() + i * cloud.point_step + field.offset);
    return values;
  }
  return {};
}

std::vector<Eigen::Vector3d> vectors(const pcl::PCLPointCloud2& cloud, const char* x, const char* y, const char* z)
{
  const std::vector<double> xs = column(cloud, x), ys = column(cloud, y), zs = column(cloud, z);
  std::vector<Eigen::Vector3d> result;
  if (xs.empty() || ys.empty() || zs.empty())
    return result;
  result.reserve(xs.size());
  for (std::size_t i = 0; i < xs.size(); ++i)
    result.emplace_back(xs[i], ys[i], zs[i]);
  return result;
}

/// PCL packs colours into four bytes, blue first, whatever type the field claims.
void addColours(const pcl::PCLPointCloud2& cloud, const pcl::PCLPointField& field, PointTable& table)
{
  const std::size_t count = std::size_t{cloud.width} * cloud.height;
  table.colours.clear();
  table.colours.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* bytes = cloud.data.data() + i * cloud.point_step + field.offset;
    table.colours.push_back({bytes[2], bytes[1], bytes[0]});
  }
}

PointTable toTable(const std::string& path, const pcl::PCLPointCloud2& cloud)
{
  PointTable table;
  table.positions = vectors(cloud, "x", "y", "z");
  if (table.positions.empty())
    throw FileError(path, "has no points with the fields x, y and z");
  for (const Eigen::Vector3d& normal : vectors(cloud, "normal_x", "normal_y", "normal_z"))
    table.normals.push_back(normal.cast<float>());
  for (const pcl::PCLPointField& field : cloud.fields) {
    const std::string& name = field.name;
    if (name == "rgb" || name == "rgba")
      addColours(cloud, field, table);
    else if (name != "x" && name != "y" && name != "z" && name.rfind("normal_", 0) != 0) {
      const std::vector<double> values = column(cloud, name);
      if (values.size() == table.size())
        table.scalars[name].assign(values.begin(), values.end());
    }
  }
  return table;
}

/// Runs one of PCL's readers; whatever it prints, throws or returns becomes one message.
PointTable readThroughPcl(const std::string& path, const char* type,
                          const std::function<int(pcl::PCLPointCloud2&)>& read)
{
  const QuietPcl quiet;
  pcl::PCLPointCloud2 cloud;
  std::string cause;
  try {
    if (read(cloud) >= 0)
      return toTable(path, cloud);
  } catch (const FileError&) {
    throw;
  } catch (const std::bad_alloc&) {
    cause = " (it declares more points than memory holds)";
  } catch (const std::exception&) {
  }
  throw FileError(path, std::string("is a truncated or malformed ") + type + " file" + cause);
}

/// What a PCD header declares.
struct PcdHeader {
  std::size_t fields = 0;
  double points = -1;
  double bytesPerPoint = 0;
  std::string data;
  std::size_t lines = 0; ///< up to and including DATA
};

PcdHeader parsePcdHeader(const std::string& path, const std::string& text)
{
  PcdHeader header;
  std::string_view line;
  std::vector<std::string_view> words;
  std::vector<double> sizes;
  Lines lines(text);
  while (header.data.empty() && lines.next(line)) {
    split(line, words);
    if (words.empty() || words[0][0] == '#')
      continue;
    double value = 0;
    std::vector<double> numbers;
    for (std::size_t i = 1; i < words.size() && toNumber(words[i], value); ++i)
      numbers.push_back(value);
    if (words[0] == "FIELDS" || words[0] == "COLUMNS")
      header.fields = words.size() - 1;
    else if (words[0] == "SIZE")
      sizes = numbers;
    else if (words[0] == "COUNT") {
      header.fields = 0;
      header.bytesPerPoint = 0;
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        header.fields += static_cast<std::size_t>(std::max(numbers[i], 0.));
        header.bytesPerPoint += i < sizes.size() ? numbers[i] * sizes[i] : 0;
      }
    } else if (words[0] == "POINTS" && !numbers.empty())
      header.points = numbers[0];
    else if (words[0] == "DATA" && words.size() > 1)
      header.data = words[1];
  }
  header.lines = lines.number();
  if (header.fields == 0 || header.data.empty())
    throw FileError(path, "is not a PCD file");
  return header;
}

/// Every point of a PCD file in text has a number, or nan, per field.
void checkPcdText(const std::string& path, const std::string& text, const PcdHeader& header)
{
  std::string_view line;
  std::vector<std::string_view> words;
  std::vector<double> values;
  for (Lines lines(text); lines.next(line);) {
    if (lines.number() <= header.lines || line.find_first_not_of(" \t") == std::string_view::npos)
      continue;
    if (!toNumbers(line, words, values) || values.size() != header.fields)
      throw FileError(path, "line " + std::to_string(lines.number()) + ": is not a row of " +
                                std::to_string(header.fields) + " numbers");
  }
}

/// The number of vertices a PLY header declares, −1 if there are none.
double plyVertices(const std::string& text)
{
  std::string_view line;
  std::vector<std::string_view> words;
  for (Lines lines(text); lines.next(line) && line != "end_header";) {
    split(line, words);
    double count = 0;
    if (words.size() == 3 && words[0] == "element" && words[1] == "vertex" && toNumber(words[2], count))
      return count;
  }
  return -1;
}

} // namespace

PointTable readPcd(const std::string& path, const std::string& text)
{
  const PcdHeader header = parsePcdHeader(path, text);
  if (header.points == 0)
    throw FileError(path, "holds no points");
  // PCL allocates what the header declares before it reads; compressed data may be smaller, by LZF at most 1:128.
  const double least = header.data == "ascii"    ? 2. * static_cast<double>(header.fields)
                       : header.data == "binary" ? std::max(header.bytesPerPoint, 1.)
                                                 : header.bytesPerPoint / 128;
  if (header.points * least > static_cast<double>(text.size()) + 1)
    throw FileError(path, "is truncated: too short for the points that it declares");
  if (header.data == "ascii")
    checkPcdText(path, text, header);
  return readThroughPcl(path, "PCD", [&](pcl::PCLPointCloud2& cloud) {
    Eigen::Vector4f origin;
    Eigen::Quaternionf orientation;
    int version = 0;
    return pcl::PCDReader().read(path, cloud, origin, orientation, version);
  });
}

PointTable readPly(const std::string& path, const std::string& text, std::vector<pcl::Vertices>* faces)
{
  if (text.compare(0, 4, "ply\n") != 0 && text.compare(0, 5, "ply\r\n") != 0)
    throw FileError(path, "is not a PLY file");
  const double vertices = plyVertices(text);
  if (vertices <= 0)
    throw FileError(path, "declares no vertices");
  if (3 * vertices > static_cast<double>(text.size()))
    throw FileError(path, "is truncated: too short for the vertices that it declares");
  return readThroughPcl(path, "PLY", [&](pcl::PCLPointCloud2& cloud) {
    Eigen::Vector4f origin;
    Eigen::Quaternionf orientation;
    int version = 0;
    if (faces == nullptr)
      return pcl::PLYReader().read(path, cloud, origin, orientation, version);
    pcl::PolygonMesh mesh;
    const int result = pcl::PLYReader().read(path, mesh, origin, orientation, version);
    cloud = std::move(mesh.cloud);
    *faces = std::move(mesh.polygons);
    return result;
  });
}

} // namespace mrf_apps

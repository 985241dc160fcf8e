// PCD, through PCL.
#include "errors.h"
#include "point_readers.h"
#include "text_file.h"

#include <pcl/common/io.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/PCLPointCloud2.h>
#include <pcl/PolygonMesh.h>

#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>
#include <optional>

namespace mrf_apps {
namespace {

/// PCL's reader prints several lines on a bad file; the tools print one of their own.
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

/// True if every value that the fields promise is there.
bool isWhole(const pcl::PCLPointCloud2& cloud)
{
  for (const pcl::PCLPointField& field : cloud.fields) {
    const int size = pcl::getFieldSize(field.datatype);
    if (size <= 0 || field.offset + std::uint64_t{field.count} * static_cast<std::uint64_t>(size) > cloud.point_step ||
        ((field.name == "rgb" || field.name == "rgba") && size * static_cast<int>(field.count) != 4))
      return false;
  }
  const std::uint64_t count = std::uint64_t{cloud.width} * cloud.height;
  return !cloud.fields.empty() && count > 0 && cloud.data.size() >= count * cloud.point_step;
}

/// True unless the body is compressed and unpacks to another size than the fields have, which PCL does not notice.
bool unpacksToSize(const pcl::PCLPointCloud2& cloud, int dataType, const std::string& text, std::size_t body)
{
  constexpr int compressed = 2;
  if (dataType != compressed)
    return true;
  std::array<std::uint32_t, 2> sizes; // packed, unpacked
  if (body + sizeof(sizes) > text.size())
    return false;
  std::memcpy(sizes.data(), text.data() + body, sizeof(sizes));
  std::uint64_t pointSize = 0;
  for (const pcl::PCLPointField& field : cloud.fields)
    if (field.name != "_") // padding is not stored
      pointSize += std::uint64_t{field.count} * static_cast<std::uint64_t>(pcl::getFieldSize(field.datatype));
  return sizes[0] <= text.size() - body - sizeof(sizes) && sizes[1] == pointSize * cloud.width * cloud.height;
}

/// What a PCD header declares.
struct PcdHeader {
  std::size_t fields = 0;
  double points = -1;
  double bytesPerPoint = 0;
  Eigen::Vector3d viewpoint = Eigen::Vector3d::Zero();
  double height = 1;
  std::string data;
  std::size_t lines = 0; ///< up to and including DATA
};

/// Where the sensor was: zero is also what no one has set, unless the cloud is an image as the sensor saw it.
std::optional<Eigen::Vector3d> sensorOriginOf(const PcdHeader& header)
{
  if (!header.viewpoint.allFinite() || (header.viewpoint.isZero(0) && !(header.height > 1)))
    return {};
  return header.viewpoint;
}

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
    else if (words[0] == "HEIGHT" && !numbers.empty())
      header.height = numbers[0];
    else if (words[0] == "VIEWPOINT" && numbers.size() == 7) // with a rotation, as a quaternion
      header.viewpoint = {numbers[0], numbers[1], numbers[2]};
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
  const QuietPcl quiet;
  pcl::PCLPointCloud2 cloud;
  try {
    Eigen::Vector4f origin;
    Eigen::Quaternionf orientation;
    int version = 0;
    int dataType = 0;
    unsigned int dataIndex = 0;
    pcl::PCDReader reader;
    // The reader goes on after a header that it could not make sense of, and crashes.
    if (reader.readHeader(path, cloud, origin, orientation, version, dataType, dataIndex) >= 0 && isWhole(cloud) &&
        unpacksToSize(cloud, dataType, text, dataIndex) &&
        reader.read(path, cloud, origin, orientation, version) >= 0 && isWhole(cloud)) {
      PointTable table = toTable(path, cloud);
      table.sensorOrigin = sensorOriginOf(header);
      return table;
    }
  } catch (const FileError&) {
    throw;
  } catch (const std::exception&) {
    // Whatever the reader throws says less than the following.
  }
  throw FileError(path, "is a truncated or malformed PCD file");
}

} // namespace mrf_apps

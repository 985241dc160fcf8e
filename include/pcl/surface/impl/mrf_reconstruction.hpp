// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The glue between PCL's point types and the plain arrays of the stages.
#pragma once

#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/common/io.h>
#include <pcl/console/print.h>
#include <pcl/conversions.h>
#include <pcl/impl/pcl_base.hpp>
#include <pcl/point_types.h>
#include <pcl/search/impl/search.hpp>
#include <pcl/type_traits.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

namespace pcl {
namespace mrf {
namespace detail {

/// Positions and normals as they lie in the point: types of users may lack PCL's maps.
template <typename PointNT>
Eigen::Vector3f positionOf(const PointNT& point)
{
  return {point.x, point.y, point.z};
}

template <typename PointNT>
void setPosition(PointNT& point, const Eigen::Vector3f& position)
{
  point.x = position.x();
  point.y = position.y();
  point.z = position.z();
}

/// The user's search object on recentered positions, lent: in the end it has its own cloud again.
template <typename PointNT>
class UserSearch : public NeighborSearch {
public:
  using SearchPtr = typename search::Search<PointNT>::Ptr;
  using CloudPtr = typename PointCloud<PointNT>::ConstPtr;

  /// \param input what it gets in the end if it has no cloud, as from PCL's own classes
  UserSearch(SearchPtr search, const CloudPtr& input)
      : search_(std::move(search)), cloud_(search_->getInputCloud()), indices_(search_->getIndices())
  {
    if (!cloud_) {
      cloud_ = input;
      indices_.reset();
    }
  }

  UserSearch(const UserSearch&) = delete;
  UserSearch& operator=(const UserSearch&) = delete;

  ~UserSearch() override
  {
    try {
      search_->setInputCloud(cloud_, indices_);
    } catch (...) { // it throws what it threw in the run, or there is no memory; the run's own outcome counts
    }
  }

  void setPoints(const std::vector<Eigen::Vector3f>& positions) override
  {
    auto cloud = std::make_shared<PointCloud<PointNT>>();
    cloud->reserve(positions.size());
    for (const Eigen::Vector3f& position : positions)
      cloud->push_back(toPoint(position));
    search_->setInputCloud(cloud);
    count_ = positions.size();
  }

  int nearest(const Eigen::Vector3f& query, int k, Neighbors& result) const override
  {
    return checked(search_->nearestKSearch(toPoint(query), k, result.indices, result.squaredDistances), k, result);
  }

  int within(const Eigen::Vector3f& query, float radius, Neighbors& result) const override
  {
    const int found = search_->radiusSearch(toPoint(query), radius, result.indices, result.squaredDistances);
    return checked(found, std::numeric_limits<int>::max(), result);
  }

private:
  /// The stages use the indices as they are: what they ask for is checked here, once.
  int checked(int found, int max, Neighbors& result) const
  {
    const auto fail = [](const std::string& what) {
      throw InvalidInput("the object of setSearchMethod answered with " + what);
    };
    if (found < 0 || found > max || static_cast<std::size_t>(found) > result.indices.size() ||
        static_cast<std::size_t>(found) > result.squaredDistances.size())
      fail(std::to_string(found) + " neighbors, and holds " + std::to_string(result.indices.size()));
    result.indices.resize(static_cast<std::size_t>(found));
    result.squaredDistances.resize(static_cast<std::size_t>(found));
    for (const auto index : result.indices)
      if (index < 0 || static_cast<std::size_t>(index) >= count_)
        fail("index " + std::to_string(index) + ", and has " + std::to_string(count_) + " points");
    for (const float distance : result.squaredDistances)
      if (!(distance >= 0))
        fail("a squared distance of " + std::to_string(distance));
    if (!std::is_sorted(result.squaredDistances.begin(), result.squaredDistances.end()))
      sort(result);
    return found;
  }

  static PointNT toPoint(const Eigen::Vector3f& position)
  {
    PointNT point;
    setPosition(point, position);
    return point;
  }

  /// An octree answers in the order of its cells.
  static void sort(Neighbors& result)
  {
    std::vector<std::pair<float, int>> entries;
    for (std::size_t n = 0; n < result.indices.size(); ++n)
      entries.emplace_back(result.squaredDistances[n], result.indices[n]);
    std::sort(entries.begin(), entries.end());
    for (std::size_t n = 0; n < entries.size(); ++n)
      std::tie(result.squaredDistances[n], result.indices[n]) = entries[n];
  }

  SearchPtr search_;
  CloudPtr cloud_; ///< that it is to have again, with the indices
  IndicesConstPtr indices_;
  std::size_t count_ = 0;
};

inline std::uint32_t packRgb(const Rgb& rgb)
{
  return static_cast<std::uint32_t>(rgb[0]) << 16 | static_cast<std::uint32_t>(rgb[1]) << 8 | rgb[2];
}

/// Color and intensity of a point as floats, where its type has them.
template <typename PointNT>
struct Attributes {
  static constexpr bool hasRgb = traits::has_color<PointNT>::value;
  static constexpr bool hasIntensity = traits::has_intensity<PointNT>::value;
  static constexpr int channels = hasRgb ? 3 : hasIntensity ? 1 : 0;

  static void read(const PointNT& point, float* values)
  {
    if constexpr (hasRgb) {
      std::uint32_t packed;
      std::memcpy(&packed, reinterpret_cast<const char*>(&point) + rgbOffset(), sizeof(packed));
      for (const unsigned shift : {16u, 8u, 0u})
        *values++ = static_cast<float>(packed >> shift & 0xff);
    } else if constexpr (hasIntensity)
      *values = point.intensity;
    else
      static_cast<void>(point), static_cast<void>(values);
  }

  /// What lies beside the color, PCL's alpha, stays.
  static void setColor(PointNT& point, const Rgb& rgb)
  {
    char* const place = reinterpret_cast<char*>(&point) + rgbOffset();
    std::uint32_t packed;
    std::memcpy(&packed, place, sizeof(packed));
    packed = (packed & 0xff000000) | packRgb(rgb);
    std::memcpy(place, &packed, sizeof(packed));
  }

private:
  static constexpr std::size_t rgbOffset()
  {
    if constexpr (traits::has_field<PointNT, fields::rgb>::value)
      return traits::offset<PointNT, fields::rgb>::value;
    else
      return traits::offset<PointNT, fields::rgba>::value;
  }
};

/// Values of a float field of the cloud, by its name; throws InvalidOption if the type lacks it.
template <typename PointNT>
std::vector<float> readField(const PointCloud<PointNT>& cloud, const Indices& indices, const std::string& name)
{
  std::vector<PCLPointField> fields;
  const int number = getFieldIndex<PointNT>(name, fields);
  if (number < 0 || fields[static_cast<std::size_t>(number)].datatype != PCLPointField::FLOAT32)
    throw InvalidOption("confidenceField = '" + name +
                        "' is not a float field of the point type; it has: " + getFieldsList(cloud));
  const std::size_t offset = fields[static_cast<std::size_t>(number)].offset;
  std::vector<float> values;
  values.reserve(indices.size());
  for (const auto index : indices) {
    float value;
    std::memcpy(&value, reinterpret_cast<const char*>(&cloud[static_cast<std::size_t>(index)]) + offset, sizeof(float));
    values.push_back(value);
  }
  return values;
}

/// Where the sensor of a cloud was, in the cloud's frame, if the cloud says so: zero is also what no one has set,
/// unless the cloud is organized, that is, an image as the sensor saw it.
template <typename PointNT>
std::optional<Eigen::Vector3d> sensorOriginOf(const PointCloud<PointNT>& cloud)
{
  const Eigen::Vector3f origin = cloud.sensor_origin_.template head<3>();
  if (!origin.allFinite() || (origin.isZero(0) && !cloud.isOrganized()))
    return {};
  return origin.cast<double>();
}

/// Adds a float32 field to a packed cloud layout that is being built. \return its offset
inline std::size_t addField(PCLPointCloud2& cloud, const char* name, PCLPointField::PointFieldTypes type)
{
  PCLPointField field;
  field.name = name;
  field.offset = cloud.point_step;
  field.datatype = static_cast<std::uint8_t>(type);
  field.count = 1;
  cloud.fields.push_back(field);
  cloud.point_step += 4;
  return field.offset;
}

} // namespace detail
} // namespace mrf

template <typename PointNT>
MRFReconstruction<PointNT>::MRFReconstruction()
{
  // The stages ask for a search object when they know which points are left.
  this->check_tree_ = false;
}

template <typename PointNT>
mrf::RawCloud MRFReconstruction<PointNT>::rawCloud() const
{
  using Attributes = mrf::detail::Attributes<PointNT>;
  constexpr bool hasNormals = traits::has_normal<PointNT>::value;
  mrf::RawCloud cloud;
  cloud.positions.reserve(indices_->size());
  cloud.normals.reserve(hasNormals ? indices_->size() : 0);
  cloud.views.reserve(views_.empty() ? 0 : indices_->size());
  for (const auto index : *indices_) {
    const PointNT& point = (*input_)[static_cast<std::size_t>(index)];
    cloud.positions.push_back(mrf::detail::positionOf(point));
    if constexpr (hasNormals)
      cloud.normals.emplace_back(point.normal_x, point.normal_y, point.normal_z);
    if (!views_.empty())
      cloud.views.push_back(views_[static_cast<std::size_t>(index)]);
  }
  if (!options_.confidenceField.empty())
    cloud.confidences = mrf::detail::readField(*input_, *indices_, options_.confidenceField);
  cloud.sensors = sensors_;
  cloud.sensorOrigin = mrf::detail::sensorOriginOf(*input_);
  cloud.attributes.channels = Attributes::channels;
  cloud.attributes.read = [this](std::size_t point, float* values) {
    Attributes::read((*input_)[static_cast<std::size_t>((*indices_)[point])], values);
  };
  return cloud;
}

template <typename PointNT>
void MRFReconstruction<PointNT>::checkInput()
{
  if (!input_ || input_->empty())
    throw mrf::InvalidInput("the input cloud is missing or empty; call setInputCloud with a cloud that has points");
  if (!this->initCompute())
    throw mrf::InvalidInput("the indices do not fit the input cloud");
  if (this->fake_indices_ && indices_->size() != input_->size())
    throw std::bad_alloc(); // which initCompute keeps to itself
  for (const auto index : *indices_)
    if (index < 0 || static_cast<std::size_t>(index) >= input_->size())
      throw mrf::InvalidInput("index " + std::to_string(index) + " is outside the cloud of " +
                              std::to_string(input_->size()) + " points");
  if (!views_.empty() && views_.size() != input_->size())
    throw mrf::InvalidInput("there are " + std::to_string(views_.size()) + " views for " +
                            std::to_string(input_->size()) +
                            " points; setSensorPositions wants one per point of the cloud");
}

template <typename PointNT>
void MRFReconstruction<PointNT>::gatherAndRun()
{
  result_.report.options = options_;
  mrf::validate(options_);
  checkInput();
  mrf::Execution execution(options_.threads, callback_);
  std::unique_ptr<mrf::NeighborSearch> search;
  if (tree_)
    search = std::make_unique<mrf::detail::UserSearch<PointNT>>(tree_, input_);
  else
    search = mrf::makePointBins();
  mrf::reconstruct(rawCloud(), options_, *search, execution, result_);
}

template <typename PointNT>
void MRFReconstruction<PointNT>::log(const mrf::Report& report) noexcept
{
  try {
    for (const std::string& warning : report.warnings)
      PCL_WARN("[pcl::MRFReconstruction::reconstruct] %s\n", warning.c_str());
    if (report.status != mrf::Status::ok)
      PCL_ERROR("[pcl::MRFReconstruction::reconstruct] %s: %s\n", mrf::toString(report.status), report.message.c_str());
  } catch (...) { // PCL's console takes memory, of which there may be none left; the report has it all
  }
}

template <typename PointNT>
template <typename Fill, typename Clear>
void MRFReconstruction<PointNT>::run(const Fill& fill, const Clear& clear)
{
  std::exception_ptr error;
  try {
    result_ = mrf::Reconstruction();
    clear();
    gatherAndRun();
    if (!keepResult_)
      releaseFieldAndPoints();
    fill();
    if (!keepResult_)
      releaseResult();
  } catch (...) {
    error = std::current_exception();
    mrf::Report report = std::move(result_.report);
    result_ = mrf::Reconstruction();
    result_.report = std::move(report);
    mrf::setFailure(error, result_.report);
    try {
      clear();
    } catch (...) { // without the memory for a name in its header; what it held is gone
    }
  }
  this->deinitCompute();
  log(result_.report);
  if (error && throwing_)
    std::rethrow_exception(error);
}

template <typename PointNT>
void MRFReconstruction<PointNT>::releaseFieldAndPoints()
{
  result_.field = mrf::DistanceField();
  const Eigen::Vector3d offset = result_.points.offset;
  result_.points = mrf::OrientedPoints();
  result_.points.offset = offset;
}

template <typename PointNT>
void MRFReconstruction<PointNT>::releaseResult()
{
  releaseFieldAndPoints();
  result_.mesh = mrf::TriangleMesh();
  result_.attributes = std::vector<float>();
  result_.surfaces = std::vector<std::vector<float>>();
}

template <typename PointNT>
void MRFReconstruction<PointNT>::reconstruct(pcl::PolygonMesh& output)
{
  performReconstruction(output);
}

template <typename PointNT>
void MRFReconstruction<PointNT>::reconstruct(PointCloud& points, std::vector<pcl::Vertices>& polygons)
{
  performReconstruction(points, polygons);
}

template <typename PointNT>
void MRFReconstruction<PointNT>::writePolygons(std::vector<pcl::Vertices>& polygons) const
{
  polygons.resize(result_.mesh.triangles.size());
  for (std::size_t t = 0; t < polygons.size(); ++t)
    polygons[t].vertices.assign(result_.mesh.triangles[t].begin(), result_.mesh.triangles[t].end());
}

template <typename PointNT>
void MRFReconstruction<PointNT>::performReconstruction(pcl::PolygonMesh& output)
{
  run([&] { write(output); }, [&] { clear(output); });
}

template <typename PointNT>
void MRFReconstruction<PointNT>::performReconstruction(PointCloud& points, std::vector<pcl::Vertices>& polygons)
{
  const auto clear = [&] {
    points = PointCloud();
    polygons.clear();
    if (input_)
      points.header = input_->header;
  };
  run([&] { write(points, polygons); }, clear);
}

template <typename PointNT>
bool MRFReconstruction<PointNT>::isColored() const
{
  return options_.colors == mrf::ColorMode::confidence || options_.colors == mrf::ColorMode::sigma ||
         (mrf::detail::Attributes<PointNT>::hasRgb && options_.colors == mrf::ColorMode::input);
}

template <typename PointNT>
bool MRFReconstruction<PointNT>::isIntense() const
{
  return mrf::detail::Attributes<PointNT>::hasIntensity && !mrf::detail::Attributes<PointNT>::hasRgb &&
         options_.colors == mrf::ColorMode::input;
}

template <typename PointNT>
void MRFReconstruction<PointNT>::clear(pcl::PolygonMesh& output) const
{
  output = pcl::PolygonMesh();
  if (input_)
    output.header = input_->header;
  pcl::PCLPointCloud2& cloud = output.cloud;
  cloud.header = output.header;
  cloud.height = 1;
  cloud.is_dense = 1;
  for (const char* name : {"x", "y", "z", "normal_x", "normal_y", "normal_z", "confidence"})
    mrf::detail::addField(cloud, name, PCLPointField::FLOAT32);
  if (isColored())
    mrf::detail::addField(cloud, "rgb", PCLPointField::FLOAT32);
  if (isIntense())
    mrf::detail::addField(cloud, "intensity", PCLPointField::FLOAT32);
  if (wantsUncertainty(options_))
    for (const char* name : {"sigma", "sigma_calibrated"})
      mrf::detail::addField(cloud, name, PCLPointField::FLOAT32);
}

template <typename PointNT>
void MRFReconstruction<PointNT>::write(pcl::PolygonMesh& output) const
{
  const mrf::TriangleMesh& mesh = result_.mesh;
  const std::vector<mrf::Rgb> colors = mrf::vertexColors(result_);
  pcl::PCLPointCloud2& cloud = output.cloud;
  cloud.width = static_cast<std::uint32_t>(mesh.vertices.size());
  cloud.row_step = cloud.point_step * cloud.width;
  cloud.data.resize(std::size_t{cloud.point_step} * cloud.width);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Eigen::Vector3f position = (mesh.vertices[v].template cast<double>() + getOffset()).template cast<float>();
    const Eigen::Vector3f& normal = mesh.normals[v];
    std::array<float, 10> values = {position.x(), position.y(), position.z(),       normal.x(),
                                    normal.y(),   normal.z(),   mesh.confidences[v]};
    std::size_t next = 7;
    if (!colors.empty()) {
      const std::uint32_t packed = mrf::detail::packRgb(colors[v]);
      std::memcpy(&values[next++], &packed, sizeof(packed));
    } else if (result_.channels == 1)
      values[next++] = result_.attributes[v];
    if (!mesh.sigmas.empty()) {
      values[next++] = mesh.sigmas[v];
      values[next] = static_cast<float>(mesh.calibrated[v]);
    }
    std::memcpy(cloud.data.data() + v * cloud.point_step, values.data(), cloud.point_step);
  }
  writePolygons(output.polygons);
}

template <typename PointNT>
void MRFReconstruction<PointNT>::write(PointCloud& points, std::vector<pcl::Vertices>& polygons) const
{
  using Attributes = mrf::detail::Attributes<PointNT>;
  const mrf::TriangleMesh& mesh = result_.mesh;
  const std::vector<mrf::Rgb> colors = Attributes::hasRgb ? mrf::vertexColors(result_) : std::vector<mrf::Rgb>();
  points.resize(mesh.vertices.size());
  points.is_dense = true;
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    PointNT& point = points[v];
    mrf::detail::setPosition(point, (mesh.vertices[v].template cast<double>() + getOffset()).template cast<float>());
    if constexpr (traits::has_normal<PointNT>::value) {
      point.normal_x = mesh.normals[v].x();
      point.normal_y = mesh.normals[v].y();
      point.normal_z = mesh.normals[v].z();
    }
    if constexpr (traits::has_field<PointNT, fields::confidence>::value)
      point.confidence = mesh.confidences[v];
    if constexpr (Attributes::hasRgb) {
      if (!colors.empty())
        Attributes::setColor(point, colors[v]);
    } else if constexpr (Attributes::hasIntensity)
      if (result_.channels == 1)
        point.intensity = result_.attributes[v];
  }
  writePolygons(polygons);
}

} // namespace pcl

#define PCL_INSTANTIATE_MRFReconstruction(T) template class PCL_MRF_EXPORT pcl::MRFReconstruction<T>;

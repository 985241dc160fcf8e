// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief The glue between PCL's point types and the plain arrays of the stages.
#pragma once

#include <pcl/surface/mrf_reconstruction.h>

#include <pcl/common/io.h>
#include <pcl/conversions.h>
#include <pcl/impl/pcl_base.hpp>
#include <pcl/PCLHeader.h>
#include <pcl/point_types.h>
#include <pcl/PolygonMesh.h>
#include <pcl/search/impl/search.hpp>
#include <pcl/search/organized.h>
#include <pcl/type_traits.h>
#include <pcl/Vertices.h>

#ifndef PCL_MRF_ONLY_TYPES_OF_PCL // PCL has compiled its searches for its own point types
#include <pcl/kdtree/impl/kdtree_flann.hpp>
#include <pcl/search/impl/kdtree.hpp>
#include <pcl/search/impl/organized.hpp>
#endif

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace pcl {
namespace mrf {
namespace detail {

/// Fields of a mesh's vertices beside x y z, normal_x normal_y normal_z and confidence; all are float32.
struct VertexFields {
  bool rgb = false;
  bool intensity = false;
  bool sigma = false; ///< and sigma_calibrated
};

/// Empties the mesh, but sets its header and fields.
PCL_MRF_EXPORT void clear(pcl::PolygonMesh& output, const PCLHeader& header, const VertexFields& fields);

/// Writes the mesh of a result, in the cloud's frame. \pre clear(output, …) was called with the result's fields
PCL_MRF_EXPORT void write(const Reconstruction& result, pcl::PolygonMesh& output);

PCL_MRF_EXPORT void write(const std::vector<Triangle>& triangles, std::vector<pcl::Vertices>& polygons);

/// Logs warnings and the failure to PCL's console; in them, and in the report, options are named by their setters.
PCL_MRF_EXPORT void log(Report& report) noexcept;

/// The exception to rethrow: the nested one of a CallerError, any other unchanged.
PCL_MRF_EXPORT std::exception_ptr asThrown(const std::exception_ptr& error);

/// Checks the answer of a user's search object, because the stages use indices unchecked, and sorts it, nearest first.
/// \param found how many neighbors it returned \param max how many were asked for \param positions how many it searches
/// \return found \throw InvalidInput if the answer is invalid
PCL_MRF_EXPORT int checkedAnswer(int found, int max, std::size_t positions, Neighbors& answer);

/// A color as in PCL's field rgb, without alpha.
inline std::uint32_t packRgb(const Rgb& rgb)
{
  return static_cast<std::uint32_t>(rgb[0]) << 16 | static_cast<std::uint32_t>(rgb[1]) << 8 | rgb[2];
}

/// Reads the members directly, because users' types may lack PCL's maps.
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

/// Lends the user's search object to the stages, on recentered positions; the destructor gives back its own cloud.
template <typename PointNT>
class UserSearch : public NeighborSearch {
public:
  using SearchPtr = typename search::Search<PointNT>::Ptr;
  using CloudPtr = typename PointCloud<PointNT>::ConstPtr;

  /// \param input the cloud to give back if the search has none, as is usual in PCL's own classes
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
    } catch (...) { // an error here repeats one of the run, or memory is short; the run's own outcome counts
    }
  }

  void setPoints(const std::vector<Eigen::Vector3f>& positions) override
  {
    auto cloud = std::make_shared<PointCloud<PointNT>>();
    cloud->reserve(positions.size());
    for (const Eigen::Vector3f& position : positions)
      cloud->push_back(toPoint(position));
    callHandedIn(searchObject, [&] { return search_->setInputCloud(cloud); });
    count_ = positions.size();
  }

  int nearest(const Eigen::Vector3f& query, int k, Neighbors& result) const override
  {
    const int found = callHandedIn(searchObject, [&] {
      return search_->nearestKSearch(toPoint(query), k, result.indices, result.squaredDistances);
    });
    return checkedAnswer(found, k, count_, result);
  }

  int within(const Eigen::Vector3f& query, float radius, Neighbors& result) const override
  {
    const int found = callHandedIn(searchObject, [&] {
      return search_->radiusSearch(toPoint(query), radius, result.indices, result.squaredDistances);
    });
    return checkedAnswer(found, std::numeric_limits<int>::max(), count_, result);
  }

private:
  static constexpr const char* searchObject = "the object of setSearchMethod";

  static PointNT toPoint(const Eigen::Vector3f& position)
  {
    PointNT point;
    setPosition(point, position);
    return point;
  }

  SearchPtr search_;
  CloudPtr cloud_; ///< to give back at the end, with the indices
  IndicesConstPtr indices_;
  std::size_t count_ = 0;
};

/// Color and intensity of a point as floats, if its type has them.
template <typename PointNT>
struct Attributes {
  static constexpr bool hasRgb = traits::has_color<PointNT>::value;
  static constexpr bool hasIntensity = traits::has_intensity<PointNT>::value;

  static void read([[maybe_unused]] const PointNT& point, [[maybe_unused]] float* values)
  {
    if constexpr (hasRgb) {
      std::uint32_t packed;
      std::memcpy(&packed, reinterpret_cast<const char*>(&point) + rgbOffset(), sizeof(packed));
      for (const unsigned shift : {16u, 8u, 0u})
        *values++ = static_cast<float>(packed >> shift & 0xff);
    }
    if constexpr (hasIntensity)
      *values = point.intensity;
  }

  /// Keeps the byte beside the color, PCL's alpha.
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

/// The values of a float field of the cloud. \param option the option that names the field, for the message
/// \throw InvalidOption if the type lacks the field
template <typename PointNT>
std::vector<float> readField(const PointCloud<PointNT>& cloud, const Indices& indices, const std::string& option,
                             const std::string& name)
{
  std::vector<PCLPointField> fields;
  const int number = getFieldIndex<PointNT>(name, fields);
  if (number < 0 || fields[number].datatype != PCLPointField::FLOAT32)
    throw InvalidOption(option + " = '" + name +
                        "' is not a float field of the point type; it has: " + getFieldsList(cloud));
  const std::size_t offset = fields[number].offset;
  std::vector<float> values;
  values.reserve(indices.size());
  for (const auto index : indices) {
    float value;
    std::memcpy(&value, reinterpret_cast<const char*>(&cloud[index]) + offset, sizeof(float));
    values.push_back(value);
  }
  return values;
}

/// The sensor origin of a cloud, in the cloud's frame, if it is set. Zero is PCL's default and does not count as set,
/// unless the cloud is organized and an image from there.
template <typename PointNT>
std::optional<Eigen::Vector3d> sensorOriginOf(const PointCloud<PointNT>& cloud)
{
  const Eigen::Vector3f origin = cloud.sensor_origin_.template head<3>();
  const auto isImage = [&] {
    return cloud.isOrganized() &&
           isImageFromZero(cloud.width, cloud.height, [&](std::size_t i) { return positionOf(cloud[i]); });
  };
  if (!origin.allFinite() || (origin.isZero(0) && !isImage()))
    return {};
  return origin.cast<double>();
}

} // namespace detail
} // namespace mrf

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
    const PointNT& point = (*input_)[index];
    cloud.positions.push_back(mrf::detail::positionOf(point));
    if constexpr (hasNormals)
      cloud.normals.emplace_back(point.normal_x, point.normal_y, point.normal_z);
    if (!views_.empty())
      cloud.views.push_back(views_[index]);
  }
  if (!options_.confidenceField.empty())
    cloud.confidences = mrf::detail::readField(*input_, *indices_, "confidenceField", options_.confidenceField);
  if (!options_.noiseField.empty())
    cloud.deviations = mrf::detail::readField(*input_, *indices_, "noiseField", options_.noiseField);
  cloud.sensors = sensors_;
  cloud.sensorOrigin = mrf::detail::sensorOriginOf(*input_);
  cloud.attributes.colors = Attributes::hasRgb;
  cloud.attributes.intensities = Attributes::hasIntensity;
  cloud.attributes.read = [this](std::size_t point, float* values) {
    Attributes::read((*input_)[(*indices_)[point]], values);
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
    throw std::bad_alloc(); // initCompute hides this failure
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
  execution.setTasks(tasks_);
  std::unique_ptr<mrf::NeighborSearch> search;
  // OrganizedNeighbor searches images, but the points that are left are no image.
  if (tree_ && !dynamic_cast<const pcl::search::OrganizedNeighbor<PointNT>*>(tree_.get()))
    search = std::make_unique<mrf::detail::UserSearch<PointNT>>(tree_, input_);
  else
    search = mrf::makeSearch(options_.search);
  mrf::reconstruct(rawCloud(), options_, *search, execution, result_, keepResult_);
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
    } catch (...) { // no memory for the header; the old content is gone
    }
  }
  this->deinitCompute();
  mrf::detail::log(result_.report);
  if (error && throwing_)
    std::rethrow_exception(mrf::detail::asThrown(error));
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
  result_.colors = std::vector<mrf::Rgb>();
  result_.intensities = std::vector<float>();
  result_.surfaces = std::vector<std::vector<float>>();
}

template <typename PointNT>
void MRFReconstruction<PointNT>::performReconstruction(pcl::PolygonMesh& output)
{
  using Attributes = mrf::detail::Attributes<PointNT>;
  const bool ofInput = options_.colors == mrf::ColorMode::input;
  mrf::detail::VertexFields fields;
  fields.rgb = ofInput ? Attributes::hasRgb : options_.colors != mrf::ColorMode::none;
  fields.intensity = ofInput && Attributes::hasIntensity;
  fields.sigma = wantsUncertainty(options_);
  const PCLHeader none; // a copy of the input's header may lack the memory for its name
  run([&] { mrf::detail::write(result_, output); },
      [&] { mrf::detail::clear(output, input_ ? input_->header : none, fields); });
}

template <typename PointNT>
void MRFReconstruction<PointNT>::performReconstruction(PointCloud& points, std::vector<pcl::Vertices>& polygons)
{
  if (input_.get() == &points) { // as callers of other classes of PCL may do; clearing would empty the input
    PointCloud output;
    performReconstruction(output, polygons);
    points = std::move(output);
    return;
  }
  const auto clear = [&] {
    points = PointCloud();
    polygons.clear();
    if (!input_)
      return;
    points.header = input_->header;
    points.sensor_origin_ = input_->sensor_origin_;
    points.sensor_orientation_ = input_->sensor_orientation_;
  };
  run([&] { write(points, polygons); }, clear);
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
    if constexpr (Attributes::hasRgb)
      if (!colors.empty())
        Attributes::setColor(point, colors[v]);
    if constexpr (Attributes::hasIntensity)
      if (!result_.intensities.empty())
        point.intensity = result_.intensities[v];
  }
  mrf::detail::write(mesh.triangles, polygons);
}

} // namespace pcl

#define PCL_INSTANTIATE_MRFReconstruction(T) template class PCL_MRF_EXPORT pcl::MRFReconstruction<T>;

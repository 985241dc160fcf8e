// SPDX-License-Identifier: BSD-3-Clause
#include "uncertainty/plausible_surfaces.h"

#include "base/loops.h"

#include <boost/math/distributions/students_t.hpp>
#include <Eigen/Geometry>

#include <cmath>
#include <utility>

namespace pcl::mrf {
namespace {

constexpr std::int64_t surfaceGrain = 8192;

/// \param values of at least two drawn surfaces \param halfWidth half of the 95 % interval, in standard deviations
SampledQuantity describe(const std::vector<double>& values, double halfWidth)
{
  SampledQuantity result;
  const auto count = static_cast<double>(values.size());
  for (const double value : values)
    result.mean += value / count;
  for (const double value : values)
    result.deviation += (value - result.mean) * (value - result.mean) / (count - 1);
  result.deviation = std::sqrt(result.deviation);
  const double half = halfWidth * result.deviation * std::sqrt(1 + 1 / count); // of one more, not of the mean
  result.lower = result.mean - half;
  result.upper = result.mean + half;
  return result;
}

/// Computes the displacements of the vertices by the draws.
class Displacement {
public:
  Displacement(const std::vector<PieceDraws>& draws, double offset, const TriangleMesh& mesh, Execution& execution)
      : draws_(draws), mesh_(mesh), execution_(execution), factors_(mesh.vertices.size(), 0),
        offsets_(mesh.vertices.size(), 0)
  {
    vertices_ = verticesOf(draws, mesh.vertices);
    const auto shared = static_cast<float>(std::abs(offset));
    forVertices([&](const PieceDraws& piece, std::size_t v) { setFactors(piece.draws, shared, v); });
  }

  std::size_t count() const { return draws_.empty() ? 0 : draws_.front().draws.size(); }

  /// The distances that a draw moves the vertices along their normals, cloud's unit.
  std::vector<float> of(std::size_t draw) const
  {
    std::vector<float> distances(mesh_.vertices.size(), 0);
    forVertices([&](const PieceDraws& piece, std::size_t v) {
      distances[v] = side(draw) * offsets_[v] - factors_[v] * piece.draws[draw].sampleDistance(mesh_.vertices[v]);
    });
    return distances;
  }

private:
  template <typename Body>
  void forVertices(const Body& body) const
  {
    for (std::size_t n = 0; n < draws_.size(); ++n)
      forEach(execution_, vertices_[n].size(), surfaceGrain,
              [&](std::size_t i) { body(draws_[n], static_cast<std::size_t>(vertices_[n][i])); });
  }

  /// The sign of a draw's offset.
  static float side(std::size_t draw) { return draw % 2 == 0 ? 1.f : -1.f; }

  /// Sets a vertex's factor of the draws and its offset, so that the mean square of its distances is σ².
  void setFactors(const std::vector<DistanceField>& draws, float shared, std::size_t v)
  {
    constexpr float most = .9f; // maximum part of sigma that the shared offset may take
    const float sigma = mesh_.sigmas[v], offset = std::min(shared, most * sigma);
    float squares = 0, sides = 0;
    for (std::size_t n = 0; n < draws.size(); ++n) {
      const float value = draws[n].sampleDistance(mesh_.vertices[v]);
      squares += value * value;
      sides += side(n) * value;
    }
    const auto count = static_cast<float>(draws.size());
    const float deviation = std::sqrt(squares / count);
    if (!(deviation > 0))
      return;
    const float factor = std::sqrt(sigma * sigma - offset * offset) / deviation;
    // With few draws, the shared offset and the rest are correlated.
    const float square = sigma * sigma - 2 * offset * factor * sides / count;
    const float scale = square > 0 ? sigma / std::sqrt(square) : 1;
    factors_[v] = scale * factor;
    offsets_[v] = scale * offset;
  }

  const std::vector<PieceDraws>& draws_;
  const TriangleMesh& mesh_;
  Execution& execution_;
  std::vector<std::vector<std::int32_t>> vertices_; ///< vertices of each piece
  std::vector<float> factors_;                      ///< factor of the draws, by vertex
  std::vector<float> offsets_;                      ///< shared offset by vertex, on either side
};

/// Measures moved meshes.
class Measurements {
public:
  Measurements(const SampledMesh& sampled, Execution& execution)
      : mesh_(sampled.mesh), isClosed_(sampled.isClosed), isFitted_(sampled.isFitted), execution_(execution)
  {}

  void add(const std::vector<float>& distances)
  {
    areas_.push_back(sum([&](const Triangle& t) { return MovedTriangle(mesh_, distances, t).area(); }));
    if (isClosed_)
      volumes_.push_back(sum([&](const Triangle& t) {
        const MovedTriangle moved(mesh_, distances, t);
        return moved.volume() + (isFitted_ ? 0 : moved.area() * moved.meanBulge());
      }));
    Eigen::AlignedBox3d box;
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v)
      box.extend((mesh_.vertices[v] + distances[v] * mesh_.normals[v]).cast<double>());
    for (std::size_t axis = 0; axis < 3; ++axis)
      extents_[axis].push_back(box.sizes()[static_cast<Eigen::Index>(axis)]);
  }

  SampledShape shape() const
  {
    SampledShape result;
    if (areas_.size() < 2)
      return result;
    result.surfaces = static_cast<int>(areas_.size());
    result.isClosed = isClosed_;
    const double halfWidth = studentHalfWidth(result.surfaces - 1);
    result.area = describe(areas_, halfWidth);
    if (isClosed_)
      result.volume = describe(volumes_, halfWidth);
    for (std::size_t axis = 0; axis < 3; ++axis)
      result.extent[axis] = describe(extents_[axis], halfWidth);
    return result;
  }

private:
  template <typename Measure>
  double sum(const Measure& measure)
  {
    return sumOver(execution_, mesh_.triangles.size(), surfaceGrain,
                   [&](std::size_t t) { return measure(mesh_.triangles[t]); });
  }

  const TriangleMesh& mesh_;
  const bool isClosed_, isFitted_;
  Execution& execution_;
  std::vector<double> areas_, volumes_;
  std::array<std::vector<double>, 3> extents_;
};

} // namespace

double studentHalfWidth(double freedom)
{
  return boost::math::quantile(boost::math::students_t(freedom), .975);
}

std::vector<std::vector<float>> samplePlausibleSurfaces(const std::vector<PieceDraws>& draws, double offset,
                                                        const SampledMesh& sampled, int kept, SampledShape& shape,
                                                        Execution& execution)
{
  const Displacement displacement(draws, offset, sampled.mesh, execution);
  Measurements measurements(sampled, execution);
  std::vector<std::vector<float>> surfaces;
  for (std::size_t n = 0; n < displacement.count(); ++n) {
    std::vector<float> distances = displacement.of(n);
    measurements.add(distances);
    if (surfaces.size() < static_cast<std::size_t>(kept))
      surfaces.push_back(std::move(distances));
    execution.poll();
  }
  shape = measurements.shape();
  return surfaces;
}

} // namespace pcl::mrf

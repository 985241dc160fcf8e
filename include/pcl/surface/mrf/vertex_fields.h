/// \file
/// \brief Per-vertex fields of the output: normals, confidence, attributes of the input, colours.
#pragma once

#include <pcl/surface/mrf/distance_field.h>
#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbour_search.h>
#include <pcl/surface/mrf/observation.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/triangle_mesh.h>

#include <array>
#include <cstdint>
#include <vector>

namespace pcl {
namespace mrf {

/// Which colours the output carries.
enum class ColourMode {
  none,      ///< none
  input,     ///< the input's RGB or intensity, interpolated, where it had them
  confidence ///< α as a colour: blue where interpolated, skin where observed (paper Fig. 4)
};

using Rgb = std::array<std::uint8_t, 3>;

/// Sets the normals: the normalised gradient of the field; the mean triangle normal where it vanishes.
void setNormals(TriangleMesh& mesh, const DistanceField& field, Execution& execution);

/// Sets the confidences (paper Sec. 3.3.3): α by the distance to the nearest point, times that point's own confidence.
/// \param search holds points.positions \param maxDistance dEmax, cloud's unit, > 0
/// \param spacing l̄, cloud's unit, if dEmax is to grow up to four times where the points' own spacing is larger than
/// that: a wall at six metres is as much surface as a cup at one; 0: the same everywhere
/// Cost: one query per vertex.
void setConfidences(TriangleMesh& mesh, const OrientedPoints& points, const NeighbourSearch& search, float maxDistance,
                    ConfidenceShape shape, Execution& execution, float spacing = 0);

/// Interpolates attributes of the data points at the vertices: mean of the 4 nearest points with weights 1/d², the
/// nearest one's value where it coincides.
/// \param attributes `channels` values per data point, point by point, in the order of the search's points
/// \return `channels` values per vertex
std::vector<float> interpolateAttributes(const std::vector<Eigen::Vector3f>& vertices, const NeighbourSearch& search,
                                         const std::vector<float>& attributes, int channels, Execution& execution);

/// Interpolated channels 0..255 as a colour, rounded. \param channels three values
Rgb toRgb(const float* channels);

/// The colour of a confidence: blue at 0 to skin at 1, linear between.
Rgb confidenceColour(float confidence);

} // namespace mrf
} // namespace pcl

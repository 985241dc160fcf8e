// SPDX-License-Identifier: BSD-3-Clause
/// Estimates from the cloud alone how far its points lie off the surface (the sensor's properties of Sec. 3.3.2; ours),
/// by the residuals of quadrics that are fitted around points. See src/method.md, "Noise".
#pragma once

#include "options/noise_law.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl::mrf {

/// Noise of the points of similar range or spacing.
struct NoiseGroup : NoiseByKey {
  double side = 0;  ///< a: side of the square that a point stands for, measured in neighborhoods wider than the noise
  double known = 0; ///< median of the given σ; 0: unknown

  bool isNoticeable() const;  ///< σ is above .4 spacings
  bool isCorrelated() const;  ///< σ is noticeable, and neighbors share most of the noise
  bool isStrong() const;      ///< σ is above .8 spacings
  double lengthening() const; ///< (c/l̄)^¼ if σ is at least a tenth of the spacing and neighbors share noise, else 1
};

struct NoiseModel {
  bool isByRange = false; ///< the key is the range from the only sensor; false: the local spacing
  Eigen::Vector3f sensor = Eigen::Vector3f::Zero();
  std::vector<NoiseGroup> groups; ///< by ascending key; empty: too few points to tell
  /// At least two thirds of the groups are. Hold-out fails then: with correlated noise, neighbors predict the noise of
  /// a point, not the surface; with strong noise, any field that bends enough passes near a held-out point.
  bool isCorrelated = false, isStrong = false;
  /// Values of the median point, cloud's unit: its key, its σ, and the smoothing length ℓ with which each group has at
  /// least the length that its noise asks for. ℓ is 0 unless the noise is correlated or strong.
  double medianKey = 0, deviation = 0, smoothing = 0;
  /// Factor for the ℓ that hold-out chooses, which is too short because hold-out takes the noise for independent. At
  /// least two thirds of the groups ask for this factor or more. 1 if the noise is correlated, strong or known.
  double lengthening = 1;
  /// Power of the key that the weights' σ is proportional to. For correlated or strong noise it is chosen so that each
  /// range has the ℓ that its noise asks for. 0 if σ is known.
  double exponent = 0;

  /// Whether the cloud shows noise by which the points are to be weighted.
  bool weighsPoints() const { return isCorrelated || isStrong || lengthening > 1; }

  /// σ of point i, cloud's unit: the known one, or that of the point's key.
  /// \pre the model was made from these points; weighsPoints(), or the noise is known
  double deviationAt(const OrientedPoints& points, std::size_t i) const;
};

/// Estimates the noise of the points; without groups if there are too few points.
/// \param search holds points.positions \param known σ of all points, used if points.deviations is empty; 0 = unknown
/// Cost: the 384 nearest points (768 unless there is exactly one sensor) of 256 points and, if these show noise, of up
/// to 2,048. The result does not depend on the number of threads.
NoiseModel estimateNoise(const OrientedPoints& points, const NeighborSearch& search, double known,
                         Execution& execution);

/// Sets points.typicalDeviation and, unless they are known, points.deviations. \pre as for deviationAt
void setDeviations(OrientedPoints& points, const NoiseModel& model, Execution& execution);

/// The sensor that saw a point: that of its view or, if the view is unknown, the nearest one. \pre there are sensors
const Eigen::Vector3f& sensorOf(const PointArrays& points, std::size_t point);

/// σ of each point by the law, cloud's unit; empty if there are no sensors or the law does not depend on the range.
std::vector<float> deviationsByLaw(const NoiseLaw& law, const PointArrays& points, Execution& execution);

} // namespace pcl::mrf

// SPDX-License-Identifier: BSD-3-Clause
/// How far the points lie off the surface, told from the cloud alone (the sensor's properties of Sec. 3.3.2; ours):
/// what a quadric through the points around a point leaves, see src/method.md, "Noise".
#pragma once

#include "options/noise_law.h"

#include <pcl/surface/mrf/execution.h>
#include <pcl/surface/mrf/neighbor_search.h>
#include <pcl/surface/mrf/point_set.h>
#include <pcl/surface/mrf/report.h>

#include <vector>

namespace pcl::mrf {

/// What the points of one range, or of one spacing, tell.
struct NoiseGroup : NoiseByKey {
  double side = 0;  ///< a, of the square that a point stands for, measured wider than noise spreads points
  double known = 0; ///< median σ, where it is known; else 0

  bool isNoticeable() const;  ///< noise that counts beside the spacing
  bool isCorrelated() const;  ///< it does, and neighbors share most of it
  bool isStrong() const;      ///< a layer nearly as thick as points are apart
  double lengthening() const; ///< (c/l̄)^¼ if neighbors share noise of a tenth of their spacing or more, else 1
};

struct NoiseModel {
  bool isByRange = false; ///< from the only sensor; else by local spacing
  Eigen::Vector3f sensor = Eigen::Vector3f::Zero();
  std::vector<NoiseGroup> groups; ///< by ascending key; empty: too few points to tell
  /// Two groups of three are. Of what is correlated, neighbors foretell of a point its noise, not its surface; in a
  /// strong one, any field that is bent enough passes near a point that is left out.
  bool isCorrelated = false, isStrong = false;
  /// Of the median point, lengths in the cloud's unit: its key, its σ, and the smoothing length ℓ with which no group
  /// has less than its noise asks for.
  double medianKey = 0, deviation = 0, smoothing = 0;
  /// By what the ℓ is too short that points left out ask for, as it suits noise that each point has of its own: what
  /// two groups of three ask for at least. 1 if the noise is correlated, strong or known.
  double lengthening = 1;
  /// Of the key, in what points weigh by: σ's, and of correlated or strong noise that with which ℓ of each range is
  /// what its noise asks for; 0 where σ is known.
  double exponent = 0;

  /// Whether the cloud shows noise that points weigh by.
  bool weighsPoints() const { return isCorrelated || isStrong || lengthening > 1; }

  /// σ of one of the points that the model was made of, cloud's unit: what is known of it, or by its key.
  /// \pre weighsPoints(), or the noise is known
  double deviationAt(const OrientedPoints& points, std::size_t i) const;
};

/// \param search holds points.positions \param known σ of all points, where they have none of their own; 0 = unknown
/// Cost: the 384 to 768 nearest points of 256 or, where these show noise, of at most 2,048. The result does not depend
/// on the number of threads.
NoiseModel estimateNoise(const OrientedPoints& points, const NeighborSearch& search, double known,
                         Execution& execution);

/// Sets the deviations of the points, unless they are known, and that of the median point, by which they weigh.
/// \pre as that of deviationAt
void setDeviations(OrientedPoints& points, const NoiseModel& model, Execution& execution);

/// The sensor that saw a point: of its view, or the nearest one where the view is not known. \pre there are sensors
const Eigen::Vector3f& sensorOf(const PointArrays& points, std::size_t point);

/// σ of each point, cloud's unit; none if there are no sensors, or the law is none of the range.
std::vector<float> deviationsByLaw(const NoiseLaw& law, const PointArrays& points, Execution& execution);

} // namespace pcl::mrf

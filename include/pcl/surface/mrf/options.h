/// \file
/// \brief All options of a reconstruction, one struct per stage, and the presets.
#pragma once

#include <pcl/surface/mrf/multiscale.h>
#include <pcl/surface/mrf/normals.h>
#include <pcl/surface/mrf/observation.h>
#include <pcl/surface/mrf/orientation.h>
#include <pcl/surface/mrf/outliers.h>
#include <pcl/surface/mrf/polygonizer.h>
#include <pcl/surface/mrf/prior.h>
#include <pcl/surface/mrf/remesher.h>
#include <pcl/surface/mrf/sampling_density.h>
#include <pcl/surface/mrf/solver.h>
#include <pcl/surface/mrf/trimming.h>
#include <pcl/surface/mrf/vertex_fields.h>

#include <string>

namespace pcl {
namespace mrf {

/// Lengths are in the cloud's unit; 0 means "derived from the sampling density" where the field says so.
struct Options {
  LengthUnit unit = LengthUnit::density; ///< of the automatic lengths
  OutlierOptions outliers;
  NormalOptions normals;
  OrientationOptions orientation;
  ObservationOptions observation;
  PriorOptions prior;
  SolverOptions solver;
  MultiscaleOptions multiscale;
  PolygonizerOptions polygonizer;
  TrimmingOptions trimming;
  RemesherOptions remesher;
  ColourMode colours = ColourMode::input;
  std::string confidenceField; ///< field of the cloud that holds per-point confidences 0..1; empty: none
  int threads = 0;             ///< 0 = one per hardware thread, ..1024
};

/// The settings that our measurements recommend; the same as Options().
Options defaultPreset();

/// The paper's own settings: PCA outlier criteria, median of 5 planes, linear α, Laplacian prior (k = 2) solved by ICM
/// over all levels, no trimming, remeshing. What differs from it:
/// - Coarse levels observe with a reach that grows with their voxels. With the paper's fixed dEmax they see next to
///   nothing, and sheets appear far from the data that ICM takes thousands of sweeps to remove.
/// - A level starts from the cubic interpolation of the coarser one, the paper's from the linear one; the coarsest is
///   solved by Cholesky.
/// - PCL's statistical filter comes before the PCA criteria, and normals that come with the cloud are kept
///   (normals.source).
/// - The volume grows beside openings, unless multiscale.padding says how far it reaches.
/// - The data weigh c_2 W = 42 W against the prior, as in the paper's program; its text for Eq. 6 gives 36/7 W.
Options paperPreset();

/// Validates every stage's options at once.
/// \throw InvalidOption naming the first value that is out of range, its range and the remedy
void validate(const Options& options);

} // namespace mrf
} // namespace pcl

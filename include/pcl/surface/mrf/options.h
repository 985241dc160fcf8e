// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief All options of a reconstruction, one struct per stage, and the presets.
#pragma once

#include <pcl/surface/mrf/export.h>
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
#include <pcl/surface/mrf/uncertainty.h>
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
  UncertaintyOptions uncertainty;
  ColorMode colors = ColorMode::input;
  std::string confidenceField; ///< field of the cloud that holds per-point confidences 0..1; empty: none
  int threads = 0;             ///< 0 = one per hardware thread, ..1024
};

/// Whether sigma is computed: on its own, or for the colors, for surfaces drawn with it or a limit to it.
inline bool wantsUncertainty(const Options& options)
{
  return options.uncertainty.compute || options.colors == ColorMode::sigma || options.uncertainty.surfaces > 0 ||
         options.uncertainty.maxError > 0;
}

/// The settings that our measurements recommend; the same as Options().
PCL_MRF_EXPORT Options defaultPreset();

/// The paper's own settings: lengths in its l̄, normals estimated anew, its PCA noise criteria, components of at least
/// 1 % of the points, the median of 5 planes, linear α over dEmax = 3 l̄, h = 2 l̄, the Laplacian prior (k = 2), its ICM
/// on all levels, each from the linear interpolation of the coarser one, ten rounds of remeshing with vertices on the
/// zero level, no trimming. All that is left in which it differs from the paper:
/// - Points (Sec. 3.1): fewer than 12 neighbors within 2.5 l̄ make a plane of the 12 nearest (normals.h). Components
///   join points within l̄ + 6 σ_l, but never less than 2.5 l̄; their normals and sides are found as orientation.h says,
///   also without sensors. Equal points count once. Points alone far from all others are dropped, and parts of a cloud
///   too far apart to say anything about each other have fields of their own (pieces.h).
/// - Observation (Sec. 3.3.3): coarse levels reach at least 1.5 of their voxels (observation.scaleWithLevel). With the
///   fixed dEmax they see next to nothing: four scans of 30,000 to 110,000 points come out in 4 to 15 components
///   instead of one, with holes 1.7 to 2.5 times as far off, for five times the time.
/// - Energy (Sec. 3.3.4): the data weigh 42 W, as in the paper's program; its text for Eq. 6 says 36/7 W
///   (Energy::paperText). β = .9 is our guess, the paper's value is not known.
/// - ICM (Sec. 3.4): voxels are visited in random order by classes that do not interact (icm.h). It stops at a change
///   of .001 voxel RMS or after 1000 sweeps, and starts from 0 on the coarsest level, which is at most 16 voxels long;
///   the paper factorizes that one (solver.choleskyOnCoarsest), which changes no hole of these scans by more than 1 %.
/// - Volume: 5 of the finest voxels around the points' box (ours). With them Fig. 9 comes out nearly as published, 2.8
///   for 2.47 of a radius of 40; the default's volume, which grows beside openings, gives .1.
/// - Mesh (Sec. 3.5): the zero level is cut out of all cells, not followed from seeds, so that sheets far from the
///   data come with it. The remesher refuses what would spoil the mesh or shorten what sticks out, and smooths borders
///   (remesher.h).
PCL_MRF_EXPORT Options paperPreset();

/// The presets by name.
enum class Preset {
  standard, ///< defaultPreset
  paper     ///< paperPreset
};

PCL_MRF_EXPORT Options presetOptions(Preset preset);

/// Validates every stage's options at once.
/// \throw InvalidOption naming the first value that is out of range, its range and the remedy
PCL_MRF_EXPORT void validate(const Options& options);

} // namespace mrf
} // namespace pcl

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// \brief Markov random field surface reconstruction as a PCL surface class.
#pragma once

#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/export.h>
#include <pcl/surface/mrf/options.h>
#include <pcl/surface/mrf/reconstruction.h>
#include <pcl/surface/mrf/report.h>

#include <pcl/surface/reconstruction.h>

#include <Eigen/Core>

#include <cstdint>
#include <string>
#include <vector>

namespace pcl {

/// Reconstructs a surface from points by regularizing a signed distance field with a Markov random field
/// (R. R. Paulsen, J. A. Bærentzen, R. Larsen, IEEE TVCG 16(4), 2010).
///
/// Lengths left at 0 are derived from the sampling density of the cloud. Setters only store; `reconstruct` validates
/// everything once, so their order does not matter, but for setPreset and setOptions, which replace all options. The
/// result does not depend on the number of threads.
///
/// On failure the output is cleared but for its header and fields, one PCL_ERROR is logged, and the report has status
/// and message; nothing is thrown, see setThrowing. Warnings are logged as PCL_WARN. The mesh's cloud carries x y z,
/// normal_x normal_y normal_z, confidence (α, 0..1), and rgb and intensity where the input had them (mean of the 4
/// nearest points, weights 1/d²). A cloud that is filled has the input's sensor_origin_ and sensor_orientation_ as
/// well.
///
/// The search object of setSearchMethod is handed clouds in a recentered frame, and in the end its own cloud again, or
/// the input cloud if it had none; answers that are none end the run as invalid input. Without one, and in place of a
/// pcl::search::OrganizedNeighbor, which finds nothing in points that are no image any more, Options::search counts.
///
/// Compiled for all of PCL's point types with x y z. For a type of your own (floats x y z, registered with
/// POINT_CLOUD_REGISTER_POINT_STRUCT; normal_x normal_y normal_z, rgb or rgba, intensity and confidence are used if it
/// has them) include pcl/surface/impl/mrf_reconstruction.hpp, as apps/examples/own_points.cpp does, or define
/// PCL_NO_PRECOMPILE before the first header of PCL's. One object is for one thread at a time.
template <typename PointNT>
class PCL_MRF_EXPORT MRFReconstruction : public SurfaceReconstruction<PointNT> {
public:
  using Ptr = shared_ptr<MRFReconstruction<PointNT>>;
  using ConstPtr = shared_ptr<const MRFReconstruction<PointNT>>;
  using PointCloud = pcl::PointCloud<PointNT>;

  MRFReconstruction() { this->check_tree_ = false; } // the stages ask for a search when they know which points are left

  /// \name Everyday settings
  /// @{

  /// Replaces all options, also what other setters set before, by those of the preset.
  void setPreset(mrf::Preset preset)
  {
    preset_ = preset;
    options_ = mrf::presetOptions(preset);
  }
  /// The one that was set last, whatever other setters changed since.
  mrf::Preset getPreset() const { return preset_; }

  /// The finest voxels beside the sampling, unless their size is set.
  void setQuality(mrf::Quality quality) { options_.multiscale.quality = quality; }
  mrf::Quality getQuality() const { return options_.multiscale.quality; }

  /// Voxel side of the finest level, cloud's unit; 0 = by the quality.
  void setVoxelSize(float size) { options_.multiscale.voxelSize = size; }
  float getVoxelSize() const { return options_.multiscale.voxelSize; }

  /// What is smaller is smoothed away, cloud's unit; 0 = by the noise, if it is set, or else chosen by the data.
  void setSmoothing(float length) { options_.observation.smoothing = length; }
  float getSmoothing() const { return options_.observation.smoothing; }

  /// Standard deviation of the scanner's noise, cloud's unit; 0 = unknown.
  void setNoise(float deviation) { options_.observation.noise = deviation; }
  float getNoise() const { return options_.observation.noise; }

  /// mrf::ObservationOptions::noiseModel, such as "quadratic:.001,.002". A law of the range needs sensors.
  void setNoiseModel(const std::string& model) { options_.observation.noiseModel = model; }
  const std::string& getNoiseModel() const { return options_.observation.noiseModel; }

  /// Whether points are dropped that a robust coarse field cannot agree with: clusters of false matches.
  void setRobust(bool robust) { options_.outliers.robust = robust; }
  bool getRobust() const { return options_.outliers.robust; }

  /// What becomes of the cloud's normals. NormalSource::use and NormalSource::reference need a point type with normals.
  void setNormalSource(mrf::NormalSource source) { options_.normals.source = source; }
  mrf::NormalSource getNormalSource() const { return options_.normals.source; }

  /// One sensor for the whole cloud, in the cloud's frame: normals are turned towards it.
  void setSensorPosition(const Eigen::Vector3d& position) { setSensorPositions({position}, {}); }

  /// The same for positions of PCL's, such as a cloud's sensor_origin_, whose fourth coordinate says nothing.
  template <typename Derived>
  void setSensorPosition(const Eigen::MatrixBase<Derived>& position)
  {
    static_assert(Derived::SizeAtCompileTime == 3 || Derived::SizeAtCompileTime == 4, "a position is x y z");
    setSensorPosition(Eigen::Vector3d(position.template head<3>().template cast<double>()));
  }

  /// Sensors, and optionally the index of the one that saw each point of the input cloud (not of the indices).
  /// Without views each point's sensor is the nearest. An empty list removes the sensors.
  void setSensorPositions(const std::vector<Eigen::Vector3d>& positions, const std::vector<std::int32_t>& views = {})
  {
    sensors_ = positions;
    views_ = views;
  }
  const std::vector<Eigen::Vector3d>& getSensorPositions() const { return sensors_; }
  const std::vector<std::int32_t>& getSensorViews() const { return views_; }

  /// Name of a float field of the points with the confidence of each, 0..1; empty: all count the same.
  void setConfidenceField(const std::string& name) { options_.confidenceField = name; }
  const std::string& getConfidenceField() const { return options_.confidenceField; }

  /// Likewise with the standard deviation of the noise of each, > 0, instead of setNoise and setNoiseModel.
  void setNoiseField(const std::string& name) { options_.noiseField = name; }
  const std::string& getNoiseField() const { return options_.noiseField; }

  /// Which surface without points is kept.
  void setTrimming(mrf::Trimming trimming) { options_.trimming.kind = trimming; }
  mrf::Trimming getTrimming() const { return options_.trimming.kind; }

  /// Largest diameter of a hole that is filled, cloud's unit; 0 = half the diagonal of the points' bounding box.
  void setMaxHole(float diameter) { options_.trimming.maxHole = diameter; }
  float getMaxHole() const { return options_.trimming.maxHole; }

  /// Whether openings of any size are closed, as flat as they allow (default no).
  void setWatertight(bool watertight) { options_.trimming.watertight = watertight; }
  bool getWatertight() const { return options_.trimming.watertight; }

  /// 0 = leave the polygonizer's triangles.
  void setNumberOfRemeshingRounds(int rounds) { options_.remesher.rounds = rounds; }
  int getNumberOfRemeshingRounds() const { return options_.remesher.rounds; }

  /// Edge that the remesher aims at, cloud's unit; 0 = the median edge of the polygonizer's triangles.
  void setTargetEdge(float length) { options_.remesher.targetEdge = length; }
  float getTargetEdge() const { return options_.remesher.targetEdge; }

  /// How many triangles the mesh has, within 2 % or with a warning; 0 = as many as the voxels ask for.
  void setTargetTriangles(std::int64_t triangles) { options_.remesher.triangles = triangles; }
  std::int64_t getTargetTriangles() const { return options_.remesher.triangles; }

  void setColorMode(mrf::ColorMode mode) { options_.colors = mode; }
  mrf::ColorMode getColorMode() const { return options_.colors; }

  /// Whether each vertex gets a sigma, see mrf::UncertaintyOptions, and a flag that is 0 where it is an extrapolation.
  void setComputeUncertainty(bool compute) { options_.uncertainty.compute = compute; }
  bool getComputeUncertainty() const { return options_.uncertainty.compute; }

  /// How many surfaces that sigma allows for come with the result: getResult().surfaces, with setKeepResult(true), and
  /// mrf::displaced.
  void setNumberOfSurfaces(int surfaces) { options_.uncertainty.surfaces = surfaces; }
  int getNumberOfSurfaces() const { return options_.uncertainty.surfaces; }

  /// Drops surface that is farther off than this, cloud's unit, in more than 5 of 100 cases; 0 = none.
  void setMaxError(float error) { options_.uncertainty.maxError = error; }
  float getMaxError() const { return options_.uncertainty.maxError; }

  /// 0 = one thread per hardware thread.
  void setNumberOfThreads(int threads) { options_.threads = threads; }
  int getNumberOfThreads() const { return options_.threads; }

  /// Called with the running stage and the fraction of the whole run that is done; returning false cancels.
  void setProgressCallback(const mrf::ProgressCallback& callback) { callback_ = callback; }
  const mrf::ProgressCallback& getProgressCallback() const { return callback_; }

  /// Does the tiles and parts of large clouds, such as mrf::TaskDirectory or mrf::tasksOfRanks(); none: reconstruct
  /// does. \param tasks outlives the call of reconstruct
  void setTaskRunner(mrf::TaskRunner* tasks) { tasks_ = tasks; }
  mrf::TaskRunner* getTaskRunner() const { return tasks_; }

  /// True: reconstruct rethrows what was thrown, also by a callback or search object, after clearing the output.
  void setThrowing(bool throwing) { throwing_ = throwing; }
  bool getThrowing() const { return throwing_; }

  /// True: getResult and getDistanceField have what the last run made until the next one or releaseResult. By default
  /// the object keeps the report only: field, points and a second mesh take several times the memory of the output.
  void setKeepResult(bool keep) { keepResult_ = keep; }
  bool getKeepResult() const { return keepResult_; }
  /// @}

  /// \name For experts
  /// @{

  /// What a surface without data looks like.
  void setPrior(mrf::Prior prior) { options_.prior.kind = prior; }
  mrf::Prior getPrior() const { return options_.prior.kind; }

  /// Where the field is observed: at the points, or at voxels, as in the paper (median is its L1 norm, mean L2).
  void setObservation(mrf::ObservationKind observation) { options_.observation.kind = observation; }
  mrf::ObservationKind getObservation() const { return options_.observation.kind; }

  /// Global weight β of data that are observed at voxels, [0, 1). How far to trust points says setSmoothing.
  void setBeta(float beta) { options_.prior.beta = beta; }
  float getBeta() const { return options_.prior.beta; }

  void setSolver(mrf::SolverMethod method) { options_.solver.method = method; }
  mrf::SolverMethod getSolver() const { return options_.solver.method; }

  /// Whether the cloud's sensor_origin_ is its sensor if setSensorPositions names none: an origin that is not zero, or
  /// any of an organized cloud. It votes on the signs of estimated normals only.
  void setUseSensorOrigin(bool use) { options_.orientation.sensorOrigin = use; }
  bool getUseSensorOrigin() const { return options_.orientation.sensorOrigin; }

  /// All options, one struct per stage.
  void setOptions(const mrf::Options& options) { options_ = options; }
  const mrf::Options& getOptions() const { return options_; }
  /// @}

  /// Reconstructs into a mesh whose cloud carries all fields. Never leaves a partial result in `output`.
  void reconstruct(pcl::PolygonMesh& output) override { performReconstruction(output); }

  /// The same into a cloud of the input's type: fields that PointNT lacks are left out.
  void reconstruct(PointCloud& points, std::vector<pcl::Vertices>& polygons) override
  {
    performReconstruction(points, polygons);
  }

  /// What the last run did, up to where it failed, also after a failure.
  const mrf::Report& getReport() const { return result_.report; }

  /// Mesh, field and points of the last successful run in plain arrays; empty without setKeepResult(true).
  const mrf::Reconstruction& getResult() const { return result_; }

  /// The regularized field of the last successful run; empty without setKeepResult(true). Its frame is the cloud's
  /// minus getOffset(). Of a cloud in pieces it is the largest one's, with otherPieces(), and samples find their own.
  const mrf::DistanceField& getDistanceField() const { return result_.field; }

  /// Add to positions of the result's frame to be in the cloud's.
  const Eigen::Vector3d& getOffset() const { return result_.points.offset; }

  /// Frees what setKeepResult(true) had kept, but for the report.
  void releaseResult();

protected:
  using SurfaceReconstruction<PointNT>::input_;
  using SurfaceReconstruction<PointNT>::indices_;
  using SurfaceReconstruction<PointNT>::tree_;

  void performReconstruction(pcl::PolygonMesh& output) override;
  void performReconstruction(PointCloud& points, std::vector<pcl::Vertices>& polygons) override;
  std::string getClassName() const override { return "MRFReconstruction"; }

private:
  /// Gathers the cloud and runs the stages into result_. \throw mrf::Error
  void gatherAndRun();
  /// The same, and `fill` with what is there then. Whatever is thrown is logged once and kept in the report, with
  /// nothing left of the result, and `clear` called.
  template <typename Fill, typename Clear>
  void run(const Fill& fill, const Clear& clear);
  void checkInput();
  mrf::RawCloud rawCloud() const;
  void write(PointCloud& points, std::vector<pcl::Vertices>& polygons) const;

  /// What the output does not need.
  void releaseFieldAndPoints();

  mrf::Preset preset_ = mrf::Preset::standard;
  mrf::Options options_;
  std::vector<Eigen::Vector3d> sensors_;
  std::vector<std::int32_t> views_;
  mrf::ProgressCallback callback_;
  mrf::TaskRunner* tasks_ = nullptr;
  bool throwing_ = false;
  bool keepResult_ = false;
  mrf::Reconstruction result_;
};

} // namespace pcl

#ifdef PCL_NO_PRECOMPILE
#include <pcl/surface/impl/mrf_reconstruction.hpp>
#endif

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

/// Reconstructs a surface from points by regularizing a signed distance field with a Markov random field (R. R.
/// Paulsen, J. A. Bærentzen, R. Larsen, IEEE TVCG 16(4), 2010).
///
/// Lengths left at 0 are derived from the sampling density of the cloud. Setters only store; `reconstruct` validates
/// all options. The order of setters does not matter, except for setPreset and setOptions, which replace all options.
/// The result does not depend on the number of threads.
///
/// On failure the output has only its header and fields, one PCL_ERROR is logged, and the report has the status and the
/// message. Nothing is thrown unless setThrowing(true) was called. Warnings are logged as PCL_WARN. The cloud of the
/// mesh has the fields x y z, normal_x normal_y normal_z, confidence (α, 0..1), and rgb and intensity if the input has
/// them (mean of the 4 nearest points, weights 1/d²). A PointCloud also gets the input's sensor pose.
///
/// The search object of setSearchMethod receives clouds in a recentered frame. At the end it receives its own cloud
/// again, or the input cloud if it had none. An invalid answer ends the run with Status::invalidInput. Options::search
/// is used if there is no search object, or if it is a pcl::search::OrganizedNeighbor, which cannot search points that
/// are no image anymore.
///
/// The class is compiled for all of PCL's point types with x y z. For your own type (floats x y z, registered with
/// POINT_CLOUD_REGISTER_POINT_STRUCT; normal_x normal_y normal_z, rgb or rgba, intensity and confidence are used if
/// present) include pcl/surface/impl/mrf_reconstruction.hpp, as apps/examples/own_points.cpp does, or define
/// PCL_NO_PRECOMPILE before the first PCL header. Only one thread at a time may use an object.
template <typename PointNT>
class PCL_MRF_EXPORT MRFReconstruction : public SurfaceReconstruction<PointNT> {
public:
  using Ptr = shared_ptr<MRFReconstruction<PointNT>>;
  using ConstPtr = shared_ptr<const MRFReconstruction<PointNT>>;
  using PointCloud = pcl::PointCloud<PointNT>;

  MRFReconstruction() { this->check_tree_ = false; } // the stages set the search's points themselves

  /// \name Everyday settings
  /// @{

  /// Replaces all options, including those that other setters set before, by the preset's.
  void setPreset(mrf::Preset preset)
  {
    preset_ = preset;
    options_ = mrf::presetOptions(preset);
  }
  /// The preset that was set last, whatever other setters changed since.
  mrf::Preset getPreset() const { return preset_; }

  /// Sets the finest voxel size relative to the sampling density; setVoxelSize overrides it.
  void setQuality(mrf::Quality quality) { options_.multiscale.quality = quality; }
  mrf::Quality getQuality() const { return options_.multiscale.quality; }

  /// Voxel side of the finest level, cloud's unit; 0 (default) = by the quality.
  void setVoxelSize(float size) { options_.multiscale.voxelSize = size; }
  float getVoxelSize() const { return options_.multiscale.voxelSize; }

  /// Details smaller than this are smoothed away, cloud's unit; 0 = by the noise if it is set, else chosen by the data.
  void setSmoothing(float length) { options_.observation.smoothing = length; }
  float getSmoothing() const { return options_.observation.smoothing; }

  /// Standard deviation of the scanner's noise, cloud's unit; 0 (default) = unknown.
  void setNoise(float deviation) { options_.observation.noise = deviation; }
  float getNoise() const { return options_.observation.noise; }

  /// Law of the noise, see ObservationOptions::noiseModel, such as "quadratic:.001,.002". A law of range needs sensors.
  void setNoiseModel(const std::string& model) { options_.observation.noiseModel = model; }
  const std::string& getNoiseModel() const { return options_.observation.noiseModel; }

  /// Whether points that disagree with a robust coarse field are dropped: clusters of false matches (default false).
  void setRobust(bool robust) { options_.outliers.robust = robust; }
  bool getRobust() const { return options_.outliers.robust; }

  /// How the cloud's normals are used. NormalSource::use and NormalSource::reference need a point type with normals.
  void setNormalSource(mrf::NormalSource source) { options_.normals.source = source; }
  mrf::NormalSource getNormalSource() const { return options_.normals.source; }

  /// One sensor position for the whole cloud, in the cloud's frame. Normals are turned towards the sensor.
  void setSensorPosition(const Eigen::Vector3d& position) { setSensorPositions({position}, {}); }

  /// The same for PCL's positions, such as a cloud's sensor_origin_; a fourth coordinate is ignored.
  template <typename Derived>
  void setSensorPosition(const Eigen::MatrixBase<Derived>& position)
  {
    static_assert(Derived::SizeAtCompileTime == 3 || Derived::SizeAtCompileTime == 4, "a position is x y z");
    setSensorPosition(Eigen::Vector3d(position.template head<3>().template cast<double>()));
  }

  /// Sensor positions, and optionally, for each point of the input cloud (not of the indices), the index of its sensor.
  /// Without `views` the nearest sensor counts as a point's own. An empty list removes the sensors.
  void setSensorPositions(const std::vector<Eigen::Vector3d>& positions, const std::vector<std::int32_t>& views = {})
  {
    sensors_ = positions;
    views_ = views;
  }
  const std::vector<Eigen::Vector3d>& getSensorPositions() const { return sensors_; }
  const std::vector<std::int32_t>& getSensorViews() const { return views_; }

  /// Name of a float field of the points with each point's confidence, 0..1; empty (default): all count the same.
  void setConfidenceField(const std::string& name) { options_.confidenceField = name; }
  const std::string& getConfidenceField() const { return options_.confidenceField; }

  /// Name of a float field with each point's σ of the noise, cloud's unit, > 0; it replaces setNoise and setNoiseModel.
  void setNoiseField(const std::string& name) { options_.noiseField = name; }
  const std::string& getNoiseField() const { return options_.noiseField; }

  /// Which surface without points is kept; default: fillings of holes.
  void setTrimming(mrf::Trimming trimming) { options_.trimming.kind = trimming; }
  mrf::Trimming getTrimming() const { return options_.trimming.kind; }

  /// Largest diameter of a hole that is filled, cloud's unit; 0 (default) = half the points' bounding box diagonal.
  void setMaxHole(float diameter) { options_.trimming.maxHole = diameter; }
  float getMaxHole() const { return options_.trimming.maxHole; }

  /// Whether openings of any size are closed, as flat as they allow (default false).
  void setWatertight(bool watertight) { options_.trimming.watertight = watertight; }
  bool getWatertight() const { return options_.trimming.watertight; }

  /// Rounds of remeshing; 0 = keep the polygonizer's triangles.
  void setNumberOfRemeshingRounds(int rounds) { options_.remesher.rounds = rounds; }
  int getNumberOfRemeshingRounds() const { return options_.remesher.rounds; }

  /// Target edge length of the remesher, cloud's unit; 0 (default) = the median edge of the polygonizer's triangles.
  void setTargetEdge(float length) { options_.remesher.targetEdge = length; }
  float getTargetEdge() const { return options_.remesher.targetEdge; }

  /// Number of triangles of the mesh, within 2 % or with a warning; 0 (default) = by the voxel size.
  void setTargetTriangles(std::int64_t triangles) { options_.remesher.triangles = triangles; }
  std::int64_t getTargetTriangles() const { return options_.remesher.triangles; }

  void setColorMode(mrf::ColorMode mode) { options_.colors = mode; }
  mrf::ColorMode getColorMode() const { return options_.colors; }

  /// Whether each vertex gets a sigma, see mrf::UncertaintyOptions, and a flag that is 0 where sigma is extrapolated.
  void setComputeUncertainty(bool compute) { options_.uncertainty.compute = compute; }
  bool getComputeUncertainty() const { return options_.uncertainty.compute; }

  /// Number of plausible surfaces in getResult().surfaces, with setKeepResult(true); see mrf::displaced.
  void setNumberOfSurfaces(int surfaces) { options_.uncertainty.surfaces = surfaces; }
  int getNumberOfSurfaces() const { return options_.uncertainty.surfaces; }

  /// Drops surface whose error exceeds this in more than 5 of 100 cases, cloud's unit; 0 (default) = none.
  void setMaxError(float error) { options_.uncertainty.maxError = error; }
  float getMaxError() const { return options_.uncertainty.maxError; }

  /// Number of threads; 0 (default) = one per hardware thread.
  void setNumberOfThreads(int threads) { options_.threads = threads; }
  int getNumberOfThreads() const { return options_.threads; }

  /// Called with the running stage and the done fraction of the whole run, 0..1; returning false cancels the run.
  void setProgressCallback(const mrf::ProgressCallback& callback) { callback_ = callback; }
  const mrf::ProgressCallback& getProgressCallback() const { return callback_; }

  /// Runs the tiles and parts of large clouds, such as mrf::TaskDirectory or mrf::tasksOfRanks(); null (default):
  /// reconstruct runs them itself. \param tasks must outlive the call of reconstruct
  void setTaskRunner(mrf::TaskRunner* tasks) { tasks_ = tasks; }
  mrf::TaskRunner* getTaskRunner() const { return tasks_; }

  /// True: reconstruct rethrows exceptions, also of a callback or search object, after clearing the output.
  void setThrowing(bool throwing) { throwing_ = throwing; }
  bool getThrowing() const { return throwing_; }

  /// True: getResult and getDistanceField hold the last run's result until the next run or releaseResult. By default
  /// only the report is kept: field, points and a second mesh take several times the memory of the output.
  void setKeepResult(bool keep) { keepResult_ = keep; }
  bool getKeepResult() const { return keepResult_; }
  /// @}

  /// \name For experts
  /// @{

  /// The prior, which decides how a surface without data looks.
  void setPrior(mrf::Prior prior) { options_.prior.kind = prior; }
  mrf::Prior getPrior() const { return options_.prior.kind; }

  /// Where the field is observed: at the points, or at voxels as in the paper (median: its L1 norm, mean: its L2 norm).
  void setObservation(mrf::ObservationKind observation) { options_.observation.kind = observation; }
  mrf::ObservationKind getObservation() const { return options_.observation.kind; }

  /// Global weight β of data observed at voxels, [0, 1). For data observed at points use setSmoothing.
  void setBeta(float beta) { options_.prior.beta = beta; }
  float getBeta() const { return options_.prior.beta; }

  void setSolver(mrf::SolverMethod method) { options_.solver.method = method; }
  mrf::SolverMethod getSolver() const { return options_.solver.method; }

  /// Whether the cloud's sensor_origin_ is its sensor if setSensorPositions gives none (default true). It must not be
  /// zero, unless the cloud is an organized image from there. It only votes on the signs of estimated normals.
  void setUseSensorOrigin(bool use) { options_.orientation.sensorOrigin = use; }
  bool getUseSensorOrigin() const { return options_.orientation.sensorOrigin; }

  /// All options, one struct per stage.
  void setOptions(const mrf::Options& options) { options_ = options; }
  const mrf::Options& getOptions() const { return options_; }
  /// @}

  /// Reconstructs into a mesh whose cloud has all fields. Never leaves a partial result in `output`.
  void reconstruct(pcl::PolygonMesh& output) override { performReconstruction(output); }

  /// Reconstructs into a cloud of the input's type, without the fields that PointNT lacks.
  void reconstruct(PointCloud& points, std::vector<pcl::Vertices>& polygons) override
  {
    performReconstruction(points, polygons);
  }

  /// The report of the last run; after a failure, up to the failure.
  const mrf::Report& getReport() const { return result_.report; }

  /// Mesh, field and points of the last successful run as plain arrays; empty without setKeepResult(true).
  const mrf::Reconstruction& getResult() const { return result_; }

  /// The regularized field of the last successful run; empty without setKeepResult(true). Its frame is the cloud's
  /// minus getOffset(). For a cloud in pieces it is the largest piece's, with otherPieces(); samples find their piece.
  const mrf::DistanceField& getDistanceField() const { return result_.field; }

  /// The offset to add to positions of the result to be in the cloud's frame.
  const Eigen::Vector3d& getOffset() const { return result_.points.offset; }

  /// Frees the result that setKeepResult(true) kept, except the report.
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
  /// Runs gatherAndRun, then `fill`. After an exception: logs it, keeps it in the report, drops the result, calls
  /// `clear`.
  template <typename Fill, typename Clear>
  void run(const Fill& fill, const Clear& clear);
  void checkInput();
  mrf::RawCloud rawCloud() const;
  void write(PointCloud& points, std::vector<pcl::Vertices>& polygons) const;

  /// Frees the part of the result that the output does not need.
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

// SPDX-License-Identifier: BSD-3-Clause
/// The module pcl_mrf._core: a run, its options, its field and files. The interface for users is in Python, around it.
#include "arrays.h"
#include "support/errors.h"
#include "support/float_offset.h"
#include "support/option_text.h"
#include "support/output_files.h"
#include "support/report_json.h"
#include "support/text_file.h"

#include <base/loops.h>
#include <pcl/surface/mrf/exceptions.h>
#include <pcl/surface/mrf/reconstruction.h>

#include <nlohmann/json.hpp>

#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <map>
#include <string>

namespace py = pybind11;

namespace mrf_apps {
namespace {

/// The keyword of a flag, such as "max_hole" for "--max-hole". "normals" and "sensors" are the names of arrays.
std::string keywordOf(const std::string& flag)
{
  if (flag == "--normals")
    return "normal_source";
  if (flag == "--sensor")
    return "sensors";
  std::string name = flag.substr(std::min<std::size_t>(flag.find_first_not_of('-'), flag.size()));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

/// A message of the library or of the command line, with keywords in place of its option names.
std::string withKeywords(const std::string& message)
{
  const std::string flags = pcl::mrf::withOptionNames(message, pcl::mrf::OptionNaming::flags);
  std::string text;
  for (std::size_t at = 0; at < flags.size();) {
    const std::size_t flag = std::min(flags.find("--", at), flags.size());
    text += flags.substr(at, flag - at);
    at = std::min(flags.find_first_not_of("-abcdefghijklmnopqrstuvwxyz", flag), flags.size());
    text += keywordOf(flags.substr(flag, at - flag));
  }
  return text;
}

using Texts = std::map<std::string, std::string>;

/// Options by keyword. \throw UsageError
pcl::mrf::Options optionsOf(const Texts& texts)
{
  pcl::mrf::Options options;
  if (const auto given = texts.find("preset"); given != texts.end()) {
    const auto& all = pcl::mrf::names<pcl::mrf::Preset>();
    const auto preset =
        std::find_if(all.begin(), all.end(), [&](const auto& entry) { return entry.first == given->second; });
    if (preset == all.end())
      throw UsageError("preset: '" + given->second + "' is none of default, paper");
    options = presetOptions(preset->second);
  }
  if (const auto model = texts.find("noise_model"); model != texts.end())
    options.observation.noiseModel = model->second;
  for (const pcl::mrf::OptionDeclaration& option : pcl::mrf::optionDeclarations())
    if (const auto given = texts.find(keywordOf(option.flag)); given != texts.end())
      if (const std::string wrong = setByText(options, option, given->second); !wrong.empty())
        throw UsageError(given->first + ": '" + given->second + "' " + wrong);
  requireMeaning(options, [&texts](const std::string& flag) { return texts.count(keywordOf(flag)) != 0; });
  return options;
}

/// The keyword, the help and the values of each option: words, or the unit of a number.
std::vector<std::array<std::string, 3>> listOptions()
{
  std::vector<std::array<std::string, 3>> list;
  for (const pcl::mrf::OptionDeclaration& option : pcl::mrf::optionDeclarations()) {
    std::string takes = option.unit;
    for (const auto& word : option.words)
      takes += (takes.empty() ? "" : "|") + word.first;
    list.push_back({keywordOf(option.flag), withKeywords(helpOf(option)), takes});
  }
  list.push_back({"preset", "what the other options change; paper: as Paulsen et al. published it", "default|paper"});
  list.push_back({"noise_model", noiseModelHelp, "model"});
  list.push_back({"no_remesh", "the same as remesh=0", "on|off"});
  return list;
}

/// Reports progress to Python, and checks for signals such as Ctrl-C.
class PythonProgress {
public:
  explicit PythonProgress(py::object told) : told_(std::move(told)) {}

  /// \return false to cancel
  bool tell(const std::string& stage, double fraction)
  {
    const py::gil_scoped_acquire lock;
    try {
      if (PyErr_CheckSignals() != 0)
        throw py::error_already_set();
      return told_.is_none() || !told_(stage, fraction).is(py::bool_(false));
    } catch (...) {
      error_ = std::current_exception();
      return false;
    }
  }

  /// Rethrows the exception that Python threw meanwhile.
  void rethrow() const
  {
    if (error_)
      std::rethrow_exception(error_);
  }

private:
  py::object told_;
  std::exception_ptr error_;
};

/// The field of a reconstruction in the cloud's frame.
class Field {
public:
  Field(pcl::mrf::DistanceField field, const Eigen::Vector3d& offset) : field_(std::move(field)), offset_(offset) {}

  py::object sample(const py::array& rows) const
  {
    const std::vector<Eigen::Vector3f> positions = toFloats(rows, offset_);
    std::vector<float> distances(positions.size());
    {
      const py::gil_scoped_release unlock;
      pcl::mrf::Execution execution(0);
      forEach(execution, static_cast<std::int64_t>(positions.size()), 4096, [&](std::size_t i) {
        distances[i] =
            isInside(positions[i]) ? field_.sampleDistance(positions[i]) : std::numeric_limits<float>::quiet_NaN();
      });
    }
    return distances.empty() ? py::array_t<float>(0) : handOver<float>(std::move(distances));
  }

  double voxelSize() const { return field_.lattice().spacing; }
  std::size_t bytes() const { return field_.bytes(); }

private:
  bool isInside(const Eigen::Vector3f& position) const
  {
    const auto isIn = [&position](const pcl::mrf::DistanceField& piece) {
      const pcl::mrf::GridSize& size = piece.lattice().size;
      const Eigen::Array3d at = piece.lattice().toVoxels(position);
      return (at >= 0).all() && (at <= Eigen::Array3d(size.x - 1, size.y - 1, size.z - 1)).all();
    };
    return isIn(field_) || std::any_of(field_.otherPieces().begin(), field_.otherPieces().end(), isIn);
  }

  pcl::mrf::DistanceField field_;
  Eigen::Vector3d offset_;
};

pcl::mrf::RawCloud cloudOf(const py::dict& arrays)
{
  pcl::mrf::RawCloud cloud;
  cloud.offset = offsetOf(arrays["points"]);
  cloud.positions = toFloats(arrays["points"], cloud.offset);
  if (py::isinstance<py::array_t<float>>(arrays["points"]) && !cloud.offset.isZero(0))
    cloud.resolution = floatRounding(toDoubles(arrays["points"]));
  if (!arrays["normals"].is_none())
    cloud.normals = toFloats(arrays["normals"], Eigen::Vector3d::Zero());
  if (!arrays["sensors"].is_none())
    cloud.sensors = toDoubles(arrays["sensors"]);
  cloud.views = elementsOf<std::int32_t, std::int32_t>(arrays["views"]);
  cloud.deviations = elementsOf<float, float>(arrays["noise"]);
  cloud.confidences = elementsOf<float, float>(arrays["confidences"]);
  cloud.attributes = attributesOf(arrays["colors"]);
  return cloud;
}

std::string reportOf(const pcl::mrf::Report& report)
{
  nlohmann::ordered_json json = {{"schema", reportSchema}, {"tool", "pcl_mrf"}, {"version", MRF_VERSION}};
  json.update(toJson(report));
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// Reconstructs. \return status, message and report, the arrays of the mesh, its field, and the drawn surfaces
py::tuple reconstruct(const py::dict& arrays, const Texts& texts, const py::object& told)
{
  PythonProgress progress(told);
  pcl::mrf::Reconstruction result;
  SurfaceMesh mesh;
  try {
    result.report.options = optionsOf(texts);
    pcl::mrf::RawCloud cloud = cloudOf(arrays);
    const py::gil_scoped_release unlock;
    const pcl::mrf::Options options = result.report.options;
    pcl::mrf::Execution execution(
        options.threads, [&](const std::string& stage, double fraction) { return progress.tell(stage, fraction); });
    const auto search = pcl::mrf::makeSearch(options.search);
    pcl::mrf::reconstruct(std::move(cloud), options, *search, execution, result, false);
    mesh = toSurfaceMesh(result, false);
  } catch (const py::error_already_set&) {
    throw;
  } catch (const UsageError& error) {
    result.report.status = pcl::mrf::Status::invalidOption;
    result.report.message = error.what();
  } catch (...) {
    progress.rethrow();
    setFailure(std::current_exception(), result.report);
  }
  const bool isDone = result.report.status == pcl::mrf::Status::ok;
  py::list surfaces;
  for (std::vector<float>& surface : result.surfaces)
    surfaces.append(handOver<float>(std::move(surface)));
  return py::make_tuple(toString(result.report.status), withKeywords(result.report.message), reportOf(result.report),
                        isDone ? toDict(std::move(mesh)) : py::dict(),
                        isDone ? py::cast(Field(std::move(result.field), result.points.offset)) : py::none(), surfaces);
}

/// Writes a mesh. \return a warning if an offset was subtracted from the vertices, else empty \throw std::runtime_error
std::string save(const py::dict& arrays, const std::string& path)
{
  const SurfaceMesh mesh = toMesh(arrays);
  const std::string format = extension(path);
  OutputFiles outputs;
  outputs.add(path);
  outputs.write(path, [&](const std::string& temporary) { writeWithoutVtk(mesh, temporary, format); });
  outputs.publish();
  const Eigen::Vector3d offset = offsetOfFloats(mesh, format);
  return offset.isZero(0) ? "" : shiftWarning(path, offset);
}

} // namespace

PYBIND11_MODULE(_core, module)
{
  module.doc() = "What pcl_mrf is made of; no part of its interface.";
  module.attr("version") = MRF_VERSION;
  module.def("options", listOptions);
  module.def("with_keywords", withKeywords);
  module.def("reconstruct", reconstruct);
  module.def("save", save);
  py::class_<Field>(module, "DistanceField",
                    "Signed distances to the surface, negative inside: field(points), with points of shape (n, 3).\n\n"
                    "The unit is the cloud's. NaN outside of the volume that was solved.")
      .def("_sample", &Field::sample)
      .def_property_readonly("voxel_size", &Field::voxelSize, "Side of the finest voxels, in the cloud's unit.")
      .def_property_readonly("nbytes", &Field::bytes, "Memory that it holds; del mesh.field frees it.");
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
#include "arrays.h"

#include "support/float_offset.h"

#include <stdexcept>

namespace py = pybind11;

namespace mrf_apps {
namespace {

/// Calls `call` with the number of rows and a function that returns a row by its index.
template <typename Call>
auto withRows(const py::array& rows, const Call& call)
{
  if (rows.ndim() != 2 || rows.shape(1) != 3)
    throw std::invalid_argument("rows of three numbers are needed");
  const auto read = [&call, count = static_cast<std::size_t>(rows.shape(0))](const auto& numbers) {
    return call(count, [&numbers](std::size_t row) {
      const auto i = static_cast<py::ssize_t>(row);
      return Eigen::Vector3d(numbers(i, 0), numbers(i, 1), numbers(i, 2));
    });
  };
  if (py::isinstance<py::array_t<float>>(rows))
    return read(py::array_t<float>(rows).unchecked<2>());
  return read(py::array_t<double>(rows).unchecked<2>());
}

template <typename Vector>
std::vector<Vector> copied(const py::array& rows, const Eigen::Vector3d& offset)
{
  return withRows(rows, [&offset](std::size_t count, const auto& row) {
    std::vector<Vector> result;
    result.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
      result.emplace_back((row(i) - offset).template cast<typename Vector::Scalar>());
    return result;
  });
}

} // namespace

std::vector<Eigen::Vector3f> toFloats(const py::array& rows, const Eigen::Vector3d& offset)
{
  return copied<Eigen::Vector3f>(rows, offset);
}

std::vector<Eigen::Vector3d> toDoubles(const py::array& rows)
{
  return copied<Eigen::Vector3d>(rows, Eigen::Vector3d::Zero());
}

Eigen::Vector3d offsetOf(const py::array& rows)
{
  return withRows(rows, [](std::size_t count, const auto& row) -> Eigen::Vector3d { return floatOffset(count, row); });
}

py::dict toDict(SurfaceMesh mesh)
{
  py::dict arrays;
  arrays["vertices"] = handOver<double>(std::move(mesh.vertices));
  arrays["triangles"] = handOver<std::int32_t>(std::move(mesh.triangles));
  arrays["normals"] = handOver<float>(std::move(mesh.normals));
  arrays["confidence"] = handOver<float>(std::move(mesh.confidences));
  arrays["colors"] = handOver<std::uint8_t>(std::move(mesh.colors));
  for (const char* name : {"sigma", "sigma_calibrated"})
    arrays[name] = handOver<float>(std::move(mesh.scalars[name]));
  return arrays;
}

SurfaceMesh toMesh(const py::dict& arrays)
{
  SurfaceMesh mesh;
  mesh.vertices = toDoubles(arrays["vertices"]);
  mesh.triangles = elementsOf<std::array<std::int32_t, 3>, std::int32_t>(arrays["triangles"]);
  mesh.normals = elementsOf<Eigen::Vector3f, float>(arrays["normals"]);
  mesh.confidences = elementsOf<float, float>(arrays["confidence"]);
  mesh.colors = elementsOf<std::array<std::uint8_t, 3>, std::uint8_t>(arrays["colors"]);
  for (const char* name : {"sigma", "sigma_calibrated"})
    if (!arrays[name].is_none())
      mesh.scalars[name] = elementsOf<float, float>(arrays[name]);
  mesh.doublePrecision = needDoubles(mesh.vertices.size(), [&](std::size_t v) { return mesh.vertices[v]; });
  return mesh;
}

pcl::mrf::PointAttributes attributesOf(const py::object& colors)
{
  if (colors.is_none())
    return {};
  if (!py::isinstance<py::array_t<std::uint8_t>>(colors)) // a converted copy would not outlive this function
    throw std::invalid_argument("colors of bytes are needed");
  const auto array = py::reinterpret_borrow<py::array_t<std::uint8_t>>(colors);
  return {true, false, [bytes = array.unchecked<2>()](std::size_t point, float* values) {
            for (py::ssize_t channel = 0; channel < 3; ++channel)
              values[channel] = bytes(static_cast<py::ssize_t>(point), channel);
          }};
}

} // namespace mrf_apps

// SPDX-License-Identifier: BSD-3-Clause
/// Converts between numpy's arrays and the library's: one copy on the way in, none on the way out.
#pragma once

#include "support/surface_mesh.h"

#include <pcl/surface/mrf/point_set.h>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <utility>
#include <vector>

namespace mrf_apps {

/// Copies rows of three numbers in single or double precision, of any strides.
/// \throw std::invalid_argument for another shape
std::vector<Eigen::Vector3f> toFloats(const pybind11::array& rows, const Eigen::Vector3d& offset);
std::vector<Eigen::Vector3d> toDoubles(const pybind11::array& rows);

/// The offset to subtract from the rows, see floatOffset.
Eigen::Vector3d offsetOf(const pybind11::array& rows);

/// Copies an array whose rows are elements; empty for None. \throw std::invalid_argument for another shape
template <typename Element, typename Number>
std::vector<Element> elementsOf(const pybind11::object& object)
{
  constexpr auto columns = static_cast<pybind11::ssize_t>(sizeof(Element) / sizeof(Number));
  if (object.is_none())
    return {};
  using Array = pybind11::array_t<Number, pybind11::array::c_style | pybind11::array::forcecast>;
  const auto array = Array::ensure(object);
  if (!array)
    throw pybind11::error_already_set();
  if (array.ndim() < 1 || array.size() != array.shape(0) * columns)
    throw std::invalid_argument("an array has another shape");
  const auto* const first = reinterpret_cast<const Element*>(array.data());
  return {first, first + array.shape(0)};
}

/// Moves the values into an array; None for no values.
template <typename Number, typename Element>
pybind11::object handOver(std::vector<Element>&& values)
{
  constexpr auto columns = static_cast<pybind11::ssize_t>(sizeof(Element) / sizeof(Number));
  if (values.empty())
    return pybind11::none();
  auto held = std::make_unique<std::vector<Element>>(std::move(values));
  std::vector<pybind11::ssize_t> shape = {static_cast<pybind11::ssize_t>(held->size())};
  if (columns > 1)
    shape.push_back(columns);
  const auto* const data = reinterpret_cast<const Number*>(held->data());
  const pybind11::capsule owner(held.get(), [](void* freed) { delete static_cast<std::vector<Element>*>(freed); });
  held.release();
  return pybind11::array_t<Number>(shape, data, owner);
}

/// Converts a mesh to a dictionary of arrays, and back.
pybind11::dict toDict(SurfaceMesh mesh);
SurfaceMesh toMesh(const pybind11::dict& arrays);

/// The colors of points, without a copy. \param colors rows of three bytes, which must outlive the result
pcl::mrf::PointAttributes attributesOf(const pybind11::object& colors);

} // namespace mrf_apps

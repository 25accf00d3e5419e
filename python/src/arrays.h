#pragma once
/// Arrays between numpy and Tactus.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <vector>

#include "tactus/base/vec.h"
#include "tactus/geom/image/image.h"

namespace tactus::python {

namespace py = pybind11;

/// A read-only array over `data`, without a copy; it keeps `owner` alive.
template <class T>
py::array view_of(const T* data, std::vector<py::ssize_t> shape, py::handle owner) {
  py::array array(py::dtype::of<T>(), std::move(shape), data, owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}
inline py::array view_of(const std::vector<Vec3f>& all, py::handle owner) {
  return view_of(&all.data()->x, {static_cast<py::ssize_t>(all.size()), 3}, owner);
}

/// An array that owns its values.
inline py::array_t<double> array_of(Vec3d v) {
  py::array_t<double> array(3);
  std::copy_n(&v.x, 3, array.mutable_data());
  return array;
}
inline py::array_t<double> array_of(const Mat3d& m) {
  py::array_t<double> array({3, 3});
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) array.mutable_at(r, c) = m(r, c);
  return array;
}

/// "a float32 array of shape (3, 4)", "a str": for messages.
std::string kind_of(py::handle value);

/// @throws usage Error: "NAME is a list, expected EXPECTED".
[[noreturn]] void refuse(const std::string& argument, py::handle value, const std::string& expected);

/// An array of just this type and number of dimensions, with its rows one after the other. @throws usage
/// Error likewise.
template <class T>
py::array_t<T, py::array::c_style> rows_of(const std::string& argument, py::handle value, int dimensions,
                                           const std::string& expected) {
  if (!py::isinstance<py::array>(value)) refuse(argument, value, expected);
  const auto array = py::reinterpret_borrow<py::array>(value);
  if (array.ndim() != dimensions) refuse(argument, value, expected);
  if (!array.dtype().equal(py::dtype::of<T>())) refuse(argument, value, expected);
  return py::array_t<T, py::array::c_style>::ensure(array);
}

/// Numbers of any kind but complex ones; no array where they aren't.
inline py::array_t<double, py::array::c_style | py::array::forcecast> doubles_of(py::handle value) {
  const auto array = py::array::ensure(value);
  if (array && array.dtype().kind() != 'c') {
    if (auto doubles = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(array))
      return doubles;
  }
  PyErr_Clear();
  return py::reinterpret_steal<py::array_t<double, py::array::c_style | py::array::forcecast>>(py::handle());
}

/// (3,), finite. @throws Error naming the argument, what it got and what it expected.
Vec3d vec3_of(const char* argument, py::handle value);
/// A pose: (4, 4), rigid. @throws Error naming the argument, what it got and what it expected.
Rigidd rigid_of(const char* argument, py::handle value);
py::array_t<double> array_of(const Rigidd& T);

/// A mask: (height, width) of bool or uint8, inside where it isn't 0; None: the camera missed the tick.
/// @throws Error likewise.
BitMask mask_of(const std::string& argument, py::handle value);
/// Radial distances [m]: (height, width) of float32; None: likewise.
DepthImage depth_of(const std::string& argument, py::handle value);
/// (height, width, 3) of uint8.
ColorImage color_of(const std::string& argument, py::handle value);

}  // namespace tactus::python

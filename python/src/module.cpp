/// `import tactus`: docs/python.md.
#include "module.h"

#include <cmath>

#include "arrays.h"
#include "tactus/base/error.h"
#include "tactus/world/device_results.h"

namespace tactus::python {

std::string kind_of(py::handle value) {
  if (!py::isinstance<py::array>(value))
    return "a " + py::str(py::type::of(value).attr("__name__")).cast<std::string>();
  const auto array = py::reinterpret_borrow<py::array>(value);
  return "a " + py::str(array.dtype()).cast<std::string>() + " array of shape " +
         py::str(array.attr("shape")).cast<std::string>();
}

void refuse(const std::string& argument, py::handle value, const std::string& expected) {
  throw usage_error(argument + " is " + kind_of(value) + ", expected " + expected);
}

Vec3d vec3_of(const char* argument, py::handle value) {
  const std::string expected = "(x, y, z) [m]";
  const auto array = doubles_of(value);
  if (!array || array.ndim() != 1 || array.shape(0) != 3) refuse(argument, value, expected);
  const Vec3d v{array.at(0), array.at(1), array.at(2)};
  if (!std::isfinite(v.x + v.y + v.z))
    throw usage_error(std::string(argument) + " is not finite, expected " + expected);
  return v;
}

Rigidd rigid_of(const char* argument, py::handle value) {
  const std::string expected = "a (4, 4) array: a rotation, and a translation [m] in the last column";
  const auto array = doubles_of(value);
  if (!array) refuse(argument, value, expected);
  if (array.ndim() != 2 || array.shape(0) != 4 || array.shape(1) != 4) refuse(argument, value, expected);
  Rigidd T;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) T.R.row[r][c] = array.at(r, c);
    T.t[r] = array.at(r, 3);
  }
  double off = 0;
  const Mat3d product = transpose(T.R) * T.R;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) off = std::max(off, std::abs(product(r, c) - (r == c ? 1 : 0)));
  const bool is_finite = std::isfinite(T.t.x) && std::isfinite(T.t.y) && std::isfinite(T.t.z);
  // Poses in float32, or products of many, are off by 1e-6.
  if (!(off < 1e-3) || !is_finite || !(dot(cross(T.R.row[0], T.R.row[1]), T.R.row[2]) > 0))
    throw usage_error(std::string(argument) + " is no rigid pose: expected " + expected);
  return T;
}

py::array_t<double> array_of(const Rigidd& T) {
  py::array_t<double> array({4, 4});
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      array.mutable_at(r, c) = r == 3 ? (c == 3 ? 1 : 0) : c == 3 ? T.t[r] : T.R(r, c);
  return array;
}

BitMask mask_of(const std::string& argument, py::handle value) {
  if (value.is_none()) return {};
  const std::string expected = "a (height, width) array of bool or uint8, or None";
  py::array array;
  if (py::isinstance<py::array>(value) && py::reinterpret_borrow<py::array>(value).dtype().kind() == 'b')
    array = rows_of<bool>(argument, value, 2, expected);
  else
    array = rows_of<std::uint8_t>(argument, value, 2, expected);
  const auto* pixels = static_cast<const std::uint8_t*>(array.data());
  BitMask mask(static_cast<Index>(array.shape(1)), static_cast<Index>(array.shape(0)));
  for (Index y = 0; y < mask.height_px; ++y)
    for (Index x = 0; x < mask.width_px; ++x)
      if (*pixels++ != 0) mask.set(x, y);
  return mask;
}

DepthImage depth_of(const std::string& argument, py::handle value) {
  if (value.is_none()) return {};
  const auto array = rows_of<float>(argument, value, 2, "a (height, width) array of float32 [m], or None");
  DepthImage image(static_cast<Index>(array.shape(1)), static_cast<Index>(array.shape(0)));
  std::copy_n(array.data(), array.size(), image.pixels.begin());
  return image;
}

ColorImage color_of(const std::string& argument, py::handle value) {
  if (value.is_none()) return {};
  const std::string expected = "a (height, width, 3) array of uint8, or None";
  const auto array = rows_of<std::uint8_t>(argument, value, 3, expected);
  if (array.shape(2) != 3) refuse(argument, value, expected);
  ColorImage image(static_cast<Index>(array.shape(1)), static_cast<Index>(array.shape(0)));
  std::copy_n(array.data(), array.size(), &image.pixels.data()->r);
  return image;
}

std::unique_lock<std::mutex> hold(std::mutex& calls, const char* object) {
  std::unique_lock<std::mutex> lock(calls, std::try_to_lock);
  if (!lock)
    throw usage_error(std::string(object) +
                      " is in a call of another thread, expected one call at a time: wait for that thread");
  return lock;
}

void PyDevices::wait_for(std::optional<std::int64_t> stream) {
  if (!stream) return;
  if (*stream < 0)
    throw usage_error("stream is " + std::to_string(*stream) +
                      ", expected a CUDA stream, as torch.cuda.current_stream().cuda_stream, or None");
  wait_for_stream(*this, static_cast<std::uintptr_t>(*stream));
}

SharedDevices devices_of(py::handle value) {
  if (py::isinstance<PyDevices>(value)) return value.cast<SharedDevices>();
  if (!py::isinstance<py::str>(value)) refuse("devices", value, "a str, as 'cpu' or 'cuda:0', or a Devices");
  return std::make_shared<PyDevices>(value.cast<std::string>());
}

}  // namespace tactus::python

PYBIND11_MODULE(_tactus, m) {
  namespace py = pybind11;
  m.doc() = "Real objects touch virtual ones. SI units, +Y up; docs/python.md.";
  py::register_exception<tactus::Error>(m, "Error", PyExc_ValueError);
  py::class_<tactus::python::PyDevices, tactus::python::SharedDevices>(
      m, "Devices", "Devices to compute on: 'auto', 'cpu', 'cpu:3' (virtual), 'cuda:0', 'cuda:all'.")
      .def(py::init([](const std::string& devices) {
             return std::make_shared<tactus::python::PyDevices>(devices);
           }),
           py::arg("devices") = "auto")
      .def_property_readonly("name", [](const tactus::python::PyDevices& d) { return d.name(); })
      .def_property_readonly("count", [](const tactus::python::PyDevices& d) { return d.count(); })
      .def("__repr__",
           [](const tactus::python::PyDevices& d) { return "tactus.Devices('" + d.name() + "')"; });
  tactus::python::bind_scene(m);
  tactus::python::bind_results(m);
  tactus::python::bind_device(m);
  tactus::python::bind_world(m);
  tactus::python::bind_frames(m);
  tactus::python::bind_source(m);
  tactus::python::bind_loop(m);
  tactus::python::bind_batch(m);
  tactus::python::bind_doctor(m);
  tactus::python::bind_calibrate(m);
  tactus::python::bind_view(m);
}

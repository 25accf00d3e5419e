// Arrays in the memory of devices: DLPack, the CUDA array interface, numpy.
#include <pybind11/stl.h>

#include "arrays.h"
#include "device_array.h"
#include "dlpack.h"
#include "tactus/base/error.h"

namespace tactus::python {

ShownRows PyDeviceArray::rows() const {
  const py::gil_scoped_release free;
  return find();
}

PyDeviceArray make_device_array(SharedDevices devices, std::string name, std::function<ShownRows()> find) {
  PyDeviceArray array{std::move(devices), std::move(name), std::move(find), nullptr};
  array.rows();
  return array;
}

PyDeviceMesh make_device_mesh(const SharedDevices& devices, const std::string& name,
                              const std::function<ShownMesh()>& find) {
  const auto vectors = [&](const char* what, View<const Vec3f> DeviceMesh::*part) {
    return make_device_array(devices, name + what, [find, part]() -> ShownRows {
      const ShownMesh shown = find();
      const View<const Vec3f> of = shown.mesh.*part;
      return {of.data(), of.size(), true, shown.owner};
    });
  };
  return {vectors(": positions", &DeviceMesh::positions_m), vectors(": normals", &DeviceMesh::normals),
          make_device_array(devices, name + ": triangles", [find]() -> ShownRows {
            const ShownMesh shown = find();
            return {shown.mesh.corners.data(), shown.mesh.corners.size() / 3, false, shown.owner};
          })};
}

namespace {

dlpack::Device device_of(const PyDeviceArray& array) {
  if (!array.devices->is_cuda()) return {dlpack::kCpu, 0};
  return {dlpack::kCuda, array.devices->device(0).ordinal()};
}

std::string device_name(const PyDeviceArray& array) {
  const dlpack::Device device = device_of(array);
  return device.kind == dlpack::kCpu ? "cpu" : "cuda:" + std::to_string(device.ordinal);
}

py::dtype dtype_of(const ShownRows& rows) {
  return rows.is_float ? py::dtype::of<float>() : py::dtype::of<std::int32_t>();
}

/// What a capsule points to. It may end on any thread, without Python's lock.
template <class M>
struct Exported {
  M managed{};
  std::int64_t shape[2], strides[2] = {3, 1};
  std::shared_ptr<const void> owner;
};

template <class M>
void end_unused(PyObject* capsule) {
  if (PyCapsule_IsValid(capsule, M::kName) == 0) return;
  auto* const managed = static_cast<M*>(PyCapsule_GetPointer(capsule, M::kName));
  managed->deleter(managed);
}

template <class M>
py::object capsule_of(const PyDeviceArray& array) {
  ShownRows rows = array.rows();
  auto exported = std::make_unique<Exported<M>>();
  exported->shape[0] = rows.rows;
  exported->shape[1] = 3;
  exported->owner = std::move(rows.owner);
  M& managed = exported->managed;
  managed.tensor = {.data = const_cast<void*>(rows.data),
                    .device = device_of(array),
                    .dimensions = 2,
                    .type = {rows.is_float ? dlpack::kFloat : dlpack::kInt, 32, 1},
                    .shape = exported->shape,
                    .strides = exported->strides,
                    .byte_offset = 0};
  managed.context = exported.get();
  managed.deleter = [](M* m) { delete static_cast<Exported<M>*>(m->context); };
  if constexpr (requires { managed.flags; }) {
    managed.major = 1;
    managed.flags = dlpack::kReadOnly;
  }
  const auto capsule = py::reinterpret_steal<py::object>(PyCapsule_New(&managed, M::kName, end_unused<M>));
  if (!capsule) throw py::error_already_set();
  exported.release();
  return capsule;
}

/// All that was computed is there when a call of this module returns, so no stream has to wait.
py::object to_dlpack(const PyDeviceArray& array, const std::optional<std::int64_t>& stream,
                     const std::optional<std::pair<int, int>>& max_version,
                     const std::optional<std::pair<int, int>>& dl_device, std::optional<bool> copy) {
  const dlpack::Device device = device_of(array);
  if (stream && device.kind == dlpack::kCpu && *stream != -1)
    throw py::buffer_error("stream is " + std::to_string(*stream) +
                           ", expected None: this array is on the CPU");
  if (stream && *stream < -1)
    throw py::buffer_error("stream is " + std::to_string(*stream) + ", expected -1, None or a CUDA stream");
  if (dl_device && *dl_device != std::pair<int, int>(device.kind, device.ordinal))
    throw py::buffer_error("dl_device is (" + std::to_string(dl_device->first) + ", " +
                           std::to_string(dl_device->second) + "), expected that of this array, (" +
                           std::to_string(device.kind) + ", " + std::to_string(device.ordinal) + ")");
  if (copy.value_or(false))
    throw py::buffer_error("copy is True, expected None or False: copy the array that this becomes");
  return max_version && max_version->first >= 1 ? capsule_of<dlpack::ManagedVersioned>(array)
                                                : capsule_of<dlpack::Managed>(array);
}

py::dict cuda_array_interface(PyDeviceArray& array) {
  if (!array.devices->is_cuda())
    throw py::attribute_error("__cuda_array_interface__: this DeviceArray is on the CPU");
  const ShownRows rows = array.rows();
  array.kept = rows.owner;
  py::dict interface;
  interface["version"] = 3;
  interface["shape"] = py::make_tuple(rows.rows, 3);
  interface["typestr"] = rows.is_float ? "<f4" : "<i4";
  interface["data"] = py::make_tuple(reinterpret_cast<std::uintptr_t>(rows.data), true);
  interface["strides"] = py::none();
  interface["stream"] = py::none();
  return interface;
}

py::array host_view(const ShownRows& rows) {
  auto* const kept = new std::shared_ptr<const void>(rows.owner);
  const py::capsule owner(kept, [](void* p) { delete static_cast<std::shared_ptr<const void>*>(p); });
  if (rows.is_float) return view_of(static_cast<const float*>(rows.data), {rows.rows, 3}, owner);
  return view_of(static_cast<const std::int32_t*>(rows.data), {rows.rows, 3}, owner);
}

py::object as_numpy(const PyDeviceArray& array, const py::object& dtype, const py::object& copy) {
  if (array.devices->is_cuda())
    throw py::type_error("this DeviceArray is in the memory of " + device_name(array) +
                         ", expected numpy() for a copy on the host");
  const py::array view = host_view(array.rows());
  const bool must_copy = !copy.is_none() && copy.cast<bool>();
  return dtype.is_none() ? must_copy ? view.attr("copy")() : py::object(view)
                         : view.attr("astype")(dtype, py::arg("copy") = must_copy);
}

template <class T>
py::array copy_of(const PyDeviceArray& array, const ShownRows& rows) {
  py::array_t<T> values({static_cast<py::ssize_t>(rows.rows), py::ssize_t{3}});
  T* const to = values.mutable_data();
  const auto count = static_cast<std::size_t>(values.size());
  const py::gil_scoped_release free;
  const auto lock = hold(array.devices->calls, "DeviceArray");
  ExecContext& ctx = array.devices->context(0);
  ctx.download(View<const T>(static_cast<const T*>(rows.data), 3 * rows.rows), std::span<T>(to, count));
  ctx.synchronize();
  return values;
}

}  // namespace

void bind_device(py::module_& m) {
  py::class_<PyDeviceArray>(
      m, "DeviceArray",
      "A result where it was computed: rows of three numbers in the memory of a GPU, or of the host. It "
      "shows "
      "the last frame, wherever that lies; the next frame writes to the same place, so that what was made of "
      "it by DLPack or __cuda_array_interface__ goes on with the world. Read it before the next step, or "
      "give "
      "that step the stream that reads. Nobody may write there.")
      .def("__dlpack__", &to_dlpack, py::kw_only(), py::arg("stream") = py::none(),
           py::arg("max_version") = py::none(), py::arg("dl_device") = py::none(),
           py::arg("copy") = py::none(),
           "For from_dlpack() of other libraries, without a copy. stream: any; results are complete. From "
           "max_version (1, 0) on, it says that it is read-only.")
      .def("__dlpack_device__",
           [](const PyDeviceArray& array) {
             const dlpack::Device device = device_of(array);
             return std::pair(device.kind, device.ordinal);
           })
      .def_property_readonly("__cuda_array_interface__", &cuda_array_interface,
                             "Version 3, read-only; AttributeError on the CPU.")
      .def("__array__", &as_numpy, py::arg("dtype") = py::none(), py::arg("copy") = py::none(),
           "On the CPU a read-only view; TypeError on a GPU.")
      .def(
          "numpy",
          [](const PyDeviceArray& array) {
            const ShownRows rows = array.rows();
            return rows.is_float ? copy_of<float>(array, rows) : copy_of<std::int32_t>(array, rows);
          },
          "A copy on the host.")
      .def_property_readonly(
          "shape", [](const PyDeviceArray& array) { return std::pair(array.rows().rows, 3); }, "(rows, 3)")
      .def_property_readonly(
          "dtype", [](const PyDeviceArray& array) { return dtype_of(array.rows()); }, "float32 or int32")
      .def_property_readonly("device", &device_name, "'cuda:0', 'cpu'")
      .def("__len__", [](const PyDeviceArray& array) { return array.rows().rows; })
      .def("__repr__", [](const PyDeviceArray& array) {
        const ShownRows rows = array.rows();
        return "tactus.DeviceArray(" + array.name + ", (" + std::to_string(rows.rows) + ", 3) " +
               (rows.is_float ? "float32" : "int32") + " on " + device_name(array) + ")";
      });
  py::class_<PyDeviceMesh>(m, "DeviceMesh", "A Mesh where it was computed.")
      .def_readonly("positions", &PyDeviceMesh::positions, "(vertices, 3) float32 [m], world")
      .def_readonly("normals", &PyDeviceMesh::normals, "(vertices, 3) float32, unit")
      .def_readonly("triangles", &PyDeviceMesh::triangles,
                    "(triangles, 3) int32, counterclockwise from outside")
      .def("__repr__", [](const PyDeviceMesh& mesh) {
        return "tactus.DeviceMesh(" + std::to_string(mesh.positions.rows().rows) + " vertices, " +
               std::to_string(mesh.triangles.rows().rows) + " triangles on " + device_name(mesh.positions) +
               ")";
      });
}

}  // namespace tactus::python

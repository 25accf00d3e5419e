#pragma once
/// Results that stay where they were computed, for libraries that go on with them there.
#include <functional>
#include <memory>
#include <string>

#include "module.h"
#include "tactus/world/device_results.h"

namespace tactus::python {

/// Rows of three numbers in a device's memory, and their owner.
struct ShownRows {
  const void* data = nullptr;
  Index rows = 0;
  bool is_float = true;  ///< or int32
  std::shared_ptr<const void> owner;
};

/// A result by its name: where it lies is asked whenever somebody looks, so it is that of the last frame.
struct PyDeviceArray {
  SharedDevices devices;
  std::string name;
  std::function<ShownRows()> find;   ///< of C++ alone: called without Python's lock; holds the devices
  std::shared_ptr<const void> kept;  ///< by users of __cuda_array_interface__, who keep this object

  ShownRows rows() const;
};
struct PyDeviceMesh {
  PyDeviceArray positions, normals, triangles;
};
/// A mesh where it lies, and its owner.
struct ShownMesh {
  DeviceMesh mesh;
  std::shared_ptr<const void> owner;
};

/// @param find as PyDeviceArray's; it is tried once @throws its errors
PyDeviceArray make_device_array(SharedDevices devices, std::string name, std::function<ShownRows()> find);
PyDeviceMesh make_device_mesh(const SharedDevices& devices, const std::string& name,
                              const std::function<ShownMesh()>& find);

}  // namespace tactus::python

TACTUS_BOUND(tactus::python::PyDeviceArray);
TACTUS_BOUND(tactus::python::PyDeviceMesh);

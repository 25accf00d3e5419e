#pragma once
/// The parts of the module, and what they share.
#include <pybind11/pybind11.h>

#include <memory>
#include <string>

#include "tactus/multi_device/device_set.h"
#include "tactus/perception/perception.h"
#include "tactus/world/world.h"

namespace tactus::python {

namespace py = pybind11;

/// Kept by all that was made on them.
using SharedDevices = std::shared_ptr<DeviceSet>;
/// From "cpu", "cuda:0", .., or a Devices.
SharedDevices devices_of(py::handle value);

struct PyScene {
  Scene scene;
  std::string path;
};

/// A mesh that someone else may own a part of.
using SharedMesh = std::shared_ptr<const TriangleMesh>;

/// One perception, made for one world.
struct PyPerception {
  SharedDevices devices;
  Scene scene;
  BodyAssets assets;
  Rig rig;
  std::unique_ptr<Perception> made;
  std::shared_ptr<const FrameSet> frame;  ///< is read until the next step ended
  bool has_world = false;
};

/// A world, and all that it refers to.
class PyWorld {
 public:
  PyWorld(SharedDevices devices, Scene scene, std::shared_ptr<PyPerception> perception);
  World& get() { return *world_; }
  const Scene& scene() const { return scene_; }
  DeviceSet& devices() { return *devices_; }
  const SharedDevices& shared_devices() const { return devices_; }
  const std::shared_ptr<PyPerception>& perception() const { return perception_; }
  std::string save_state();
  void load_state(const std::string& bytes);
  /// @throws Error unless it is above 0, or 0.
  StepReport step(double dt_s);

 private:
  SharedDevices devices_;
  Scene scene_;
  BodyAssets assets_;
  std::shared_ptr<PyPerception> perception_;
  std::unique_ptr<World> world_;
};

void bind_scene(py::module_& m);
void bind_world(py::module_& m);
void bind_frames(py::module_& m);

}  // namespace tactus::python

#pragma once
/// The parts of the module, and what they share.
#include <pybind11/pybind11.h>

#include <memory>
#include <mutex>
#include <string>

#include "tactus/multi_device/device_set.h"
#include "tactus/perception/perception.h"
#include "tactus/sim/scene.h"
#include "tactus/world/world.h"

namespace tactus::python {

namespace py = pybind11;

/// Kept by all that was made on them.
using SharedDevices = std::shared_ptr<DeviceSet>;
/// From "cpu", "cuda:0", .., or a Devices.
SharedDevices devices_of(py::handle value);

/// Python's threads run while a call computes. An object takes one call at a time.
/// @throws usage Error during a call of another thread.
std::unique_lock<std::mutex> hold(std::mutex& calls, const char* object);

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
  std::mutex calls;
  bool has_world = false;
};

/// A world, and all that it refers to.
class PyWorld {
 public:
  PyWorld(SharedDevices devices, Scene scene, std::shared_ptr<PyPerception> perception);
  /// The world for one call: it lives as long as the expression, or as the variable that keeps it.
  class Held {
   public:
    Held(std::mutex& calls, World& world) : lock_(hold(calls, "World")), world_(&world) {}
    World* operator->() const { return world_; }
    World& operator*() const { return *world_; }

   private:
    std::unique_lock<std::mutex> lock_;
    World* world_;
  };
  /// @throws usage Error during a call of another thread.
  Held get() { return {calls_, *world_}; }
  /// For a loop, which calls it on one thread.
  World& unheld() { return *world_; }
  const Scene& scene() const { return scene_; }
  const BodyAssets& assets() const { return assets_; }
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
  std::mutex calls_;
};

void bind_scene(py::module_& m);
void bind_world(py::module_& m);
void bind_frames(py::module_& m);
void bind_doctor(py::module_& m);
/// After the others: it adds World.batch().
void bind_batch(py::module_& m);
/// After the others: it adds World.show().
void bind_view(py::module_& m);

}  // namespace tactus::python

#pragma once
/// The parts of the module, and what they share.
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "made.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/perception/perception.h"
#include "tactus/sim/scene.h"
#include "tactus/world/world.h"

namespace tactus::python {

namespace py = pybind11;

/// Devices take one call at a time: streams are not for several threads.
struct PyDevices : DeviceSet {
  using DeviceSet::DeviceSet;
  /// From now on, work comes after all that a CUDA stream has to do now. @throws usage Error on a CPU.
  void wait_for(std::optional<std::int64_t> stream);
  std::mutex calls;
};
/// Kept by all that was made on them.
using SharedDevices = std::shared_ptr<PyDevices>;
/// From "cpu", "cuda:0", .., or a Devices.
SharedDevices devices_of(py::handle value);

/// Python's threads run while a call computes. An object takes one call at a time.
/// @throws usage Error during a call of another thread.
std::unique_lock<std::mutex> hold(std::mutex& calls, const char* object);

struct PyScene {
  Scene scene;
  std::string path;
  std::uint64_t hash = 0;  ///< of its text: states of an edited scene are refused
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
/// nullptr for a rig without cameras.
std::shared_ptr<PyPerception> perception_of(const SharedDevices& devices, const PyScene& scene,
                                            const Rig& rig, bool can_reduce = false);

/// A world, and all that it refers to.
class PyWorld {
 public:
  PyWorld(SharedDevices devices, PyScene scene, std::shared_ptr<PyPerception> perception);
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
  Held get() { return {devices_->calls, *world_}; }
  /// For a loop, which holds its devices.
  World& unheld() { return *world_; }
  /// Arrays of other libraries outlive a world that load_state() replaces.
  const std::shared_ptr<World>& shared() const { return world_; }
  const Scene& scene() const { return scene_.scene; }
  const PyScene& described() const { return scene_; }
  const BodyAssets& assets() const { return assets_; }
  DeviceSet& devices() { return *devices_; }
  const SharedDevices& shared_devices() const { return devices_; }
  const std::shared_ptr<PyPerception>& perception() const { return perception_; }
  std::string save_state();
  void load_state(const std::string& bytes);
  void set_surface(const Observation& seen);
  /// @throws Error unless it is above 0, or 0.
  StepReport step(double dt_s, std::optional<std::int64_t> stream);
  /// As World's, by one thread that holds this world all the while.
  void begin_step(double dt_s, std::optional<std::int64_t> stream);
  std::optional<StepReport> continue_step();

  // For a FrameLoop.
  void begin_loop() { ++loops_; }
  /// @param lost_images it ended before the step of new images did: they are gone
  void end_loop(bool lost_images);

 private:
  SharedDevices devices_;
  PyScene scene_;
  BodyAssets assets_;
  std::shared_ptr<PyPerception> perception_;
  std::shared_ptr<World> world_;
  int loops_ = 0;  ///< that run
  bool lost_images_ = false;
};

/// Frames: of a scene's source, or of a class of Python that derives from this one.
struct PyFrameSource {
  std::unique_ptr<FrameSource> opened;  ///< nullptr: of a class of Python
  Rig rig;
  std::optional<int> frame_count;
  std::optional<double> fps;
  std::mutex calls;
};

void bind_scene(py::module_& m);
/// Before the others.
void bind_results(py::module_& m);
void bind_device(py::module_& m);
void bind_world(py::module_& m);
void bind_frames(py::module_& m);
void bind_doctor(py::module_& m);
void bind_calibrate(py::module_& m);
void bind_source(py::module_& m);
/// After bind_source().
void bind_loop(py::module_& m);
/// After the others: it adds World.batch().
void bind_batch(py::module_& m);
/// After the others: it adds World.show().
void bind_view(py::module_& m);

}  // namespace tactus::python

TACTUS_BOUND(tactus::python::PyDevices);
TACTUS_BOUND(tactus::python::PyScene);
TACTUS_BOUND(tactus::python::PyPerception);
TACTUS_BOUND(tactus::python::PyWorld);
TACTUS_BOUND(tactus::python::PyFrameSource);
TACTUS_BOUND(tactus::TriangleMesh);
TACTUS_BOUND(tactus::Notice);
TACTUS_BOUND(tactus::BodyContact);
TACTUS_BOUND(tactus::StepReport);
TACTUS_BOUND(tactus::BodyMonitors);
TACTUS_BOUND(tactus::StrokeResult);
TACTUS_BOUND(tactus::Grab);
TACTUS_BOUND(tactus::FrameSnapshot);
TACTUS_BOUND(tactus::SceneParameter);
TACTUS_BOUND(tactus::Camera);
TACTUS_BOUND(tactus::Rig);
TACTUS_BOUND(tactus::FrameSet);
TACTUS_BOUND(tactus::Observation);

// Sources of scenes, and pictures.
#include <pybind11/stl.h>

#include <chrono>
#include <mutex>
#include <optional>
#include <thread>

#include "arrays.h"
#include "module.h"
#include "tactus/base/error.h"
#include "tactus/run/scene_source.h"
#include "tactus/run/scene_view.h"
#include "tactus/sim/scene.h"
#include "tactus/view/renderer.h"

namespace tactus::python {
namespace {

/// A scene's cameras, taken by hand.
struct PySource {
  std::unique_ptr<FrameSource> source;
  std::unique_ptr<std::mutex> calls = std::make_unique<std::mutex>();
};

PySource open_source(const PyScene& scene) {
  if (scene.scene.source.kind == SourceKind::none)
    throw usage_error(scene.path + ": 'source.kind' is none, expected a source of images");
  return {open_scene_source(scene.scene, scene.path)};
}

/// nullptr at the end.
std::shared_ptr<FrameSet> next_frame(PySource& from) {
  const auto lock = hold(*from.calls, "FrameSource");
  auto frame = std::make_shared<FrameSet>();
  for (;;) {
    {
      const py::gil_scoped_release free;
      switch (from.source->next(*frame)) {
        case NextFrame::success:
          return frame;
        case NextFrame::no_more_data:
          return nullptr;
        case NextFrame::bad_frame:
          throw Error("frame " + std::to_string(frame->tick) + " has no image: " + from.source->status());
        case NextFrame::nothing_new:  // live cameras
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
}

/// One renderer for all worlds: to start OpenGL takes longer than a picture. It ends with the process, whose
/// driver may be gone before destructors of statics run.
Renderer& shared_renderer(Index width_px, Index height_px) {
  static Renderer* const renderer = new Renderer({.width_px = width_px, .height_px = height_px});
  renderer->resize(width_px, height_px);
  return *renderer;
}

py::array_t<std::uint8_t> show(PyWorld& world, std::pair<Index, Index> size_px) {
  static std::mutex pictures;
  ColorImage image;
  {
    const py::gil_scoped_release free;
    const PyWorld::Held held = world.get();
    const std::scoped_lock lock(pictures);
    PyPerception* const seen = world.perception().get();
    Scene scene = world.scene();
    scene.view.photographs = 0;
    scene.view.size_px.x = size_px.first;
    scene.view.size_px.y = size_px.second;
    SceneView view(scene, seen != nullptr ? seen->rig : Rig(), world.assets(), *held);
    view.show(held->snapshot(), {});
    shared_renderer(size_px.first, size_px.second).render(view.scene(), view.camera(), image);
  }
  py::array_t<std::uint8_t> pixels(
      {static_cast<py::ssize_t>(image.height_px), static_cast<py::ssize_t>(image.width_px), py::ssize_t{3}});
  std::copy_n(&image.pixels.data()->r, pixels.size(), pixels.mutable_data());
  return pixels;
}

}  // namespace

void bind_view(py::module_& m) {
  py::class_<PySource>(m, "FrameSource", "The cameras of a scene: live, films, masks, synthetic ones.")
      .def_property_readonly("rig", [](const PySource& s) { return s.source->rig(); })
      .def_property_readonly("frame_count", [](const PySource& s) { return s.source->frame_count(); })
      .def_property_readonly("fps", [](const PySource& s) { return s.source->fps(); })
      .def_property_readonly(
          "status", [](const PySource& s) { return s.source->status(); },
          "oddities of the last frame: \"camera 'cam2': the mask is all white\"; '' when all is well")
      .def("next_frame", &next_frame,
           "The next Frame; None at the end. Waits for live cameras.\n\n"
           "Raises Error for a frame that no camera delivered; the next may be fine.");
  m.def("open_scene_source", &open_source, py::arg("scene"),
        "Opens the source of a scene: a FrameSource, for Perception.observe() or VisualHull.reconstruct().");
  const py::object world = m.attr("World");
  world.attr("show") = py::cpp_function(
      &show, py::name("show"), py::is_method(world), py::arg("size_px") = std::pair<Index, Index>(960, 540),
      "A picture of the world as the scene's 'view' looks at it: (height, width, 3) uint8, sRGB.\n\n"
      "size_px: (width, height), 16 to 8192. Raises Error where there is no OpenGL 4.5.");
}

}  // namespace tactus::python

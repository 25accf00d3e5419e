// Sources of frames: a scene's, or classes of Python.
#include <pybind11/stl.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "module.h"
#include "tactus/base/error.h"
#include "tactus/run/scene_source.h"

namespace tactus::python {
namespace {

std::shared_ptr<PyFrameSource> open_source(const PyScene& scene) {
  auto from = std::make_shared<PyFrameSource>();
  const py::gil_scoped_release free;
  from->opened = open_scene_source(scene.scene, scene.path);
  from->rig = from->opened->rig();
  return from;
}

std::shared_ptr<PyFrameSource> made_source(const Rig* rig, std::optional<int> frame_count,
                                           std::optional<double> fps) {
  if (frame_count && *frame_count < 0)
    throw usage_error("frame_count is " + std::to_string(*frame_count) + ", expected 0 or more, or None");
  if (fps && !(*fps > 0 && std::isfinite(*fps)))
    throw usage_error("fps is " + number_text(*fps) + ", expected frames per second, above 0, or None");
  auto from = std::make_shared<PyFrameSource>();
  if (rig != nullptr) from->rig = *rig;
  from->frame_count = frame_count;
  from->fps = fps;
  return from;
}

/// nullptr at the end.
std::shared_ptr<FrameSet> next_frame(PyFrameSource& from) {
  if (from.opened == nullptr) {
    PyErr_SetString(PyExc_NotImplementedError,
                    "a class that derives from FrameSource has a next_frame(): it gives a Frame, or None at "
                    "the end");
    throw py::error_already_set();
  }
  const auto lock = hold(from.calls, "FrameSource");
  auto frame = std::make_shared<FrameSet>();
  for (;;) {
    {
      const py::gil_scoped_release free;
      switch (from.opened->next(*frame)) {
        case NextFrame::success:
          return frame;
        case NextFrame::no_more_data:
          return nullptr;
        case NextFrame::bad_frame:
          throw Error("frame " + std::to_string(frame->tick) + " has no image: " + from.opened->status());
        case NextFrame::nothing_new:
          if (from.rig.cameras.empty()) return frame;
          std::this_thread::sleep_for(std::chrono::milliseconds(1));  // live cameras
      }
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
}

}  // namespace

void bind_source(py::module_& m) {
  py::class_<PyFrameSource, std::shared_ptr<PyFrameSource>>(
      m, "FrameSource",
      "Frames of a rig: open_scene_source() opens those of a scene. Derive from it for frames of your own: "
      "next_frame() gives a Frame, or None at the end. A Frame without masks says that nothing new came by "
      "its time; one whose masks are all None that no camera delivered.")
      .def(py::init(&made_source), py::arg("rig") = nullptr, py::arg("frame_count") = std::nullopt,
           py::arg("fps") = std::nullopt,
           "For derived classes. rig: None: no cameras, time passes. frame_count: where it is known.")
      .def_property_readonly("rig", [](const PyFrameSource& s) { return s.rig; })
      .def_property_readonly(
          "frame_count",
          [](const PyFrameSource& s) { return s.opened ? s.opened->frame_count() : s.frame_count; },
          "where it is known beforehand; else None")
      .def_property_readonly("fps", [](const PyFrameSource& s) { return s.opened ? s.opened->fps() : s.fps; })
      .def_property_readonly(
          "status", [](const PyFrameSource& s) { return s.opened ? s.opened->status() : std::string(); },
          "oddities of the last frame: \"camera 'cam2': the mask is all white\"; '' when all is well")
      .def("next_frame", &next_frame,
           "The next Frame; None at the end. Waits for live cameras.\n\n"
           "Raises Error for a frame that no camera delivered; the next may be fine.");
  m.def("open_scene_source", &open_source, py::arg("scene"),
        "Opens the source of a scene: a FrameSource, for a FrameLoop, Perception.observe() or "
        "VisualHull.reconstruct().");
}

}  // namespace tactus::python

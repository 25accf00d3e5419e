// The loop over frames, with sources, sinks and controllers of Python.
#include <pybind11/stl.h>

#include "arrays.h"
#include "module.h"
#include "tactus/base/error.h"
#include "tactus/run/frame_loop.h"
#include "tactus/run/scene_source.h"

namespace tactus::python {
namespace {

/// The base of sinks of Python.
struct PyFrameSink {};

/// A frame as sinks see it, during FrameSink.frame() alone.
struct PyRunFrame {
  RunFrame* frame;  ///< nullptr afterwards
  std::shared_ptr<PyWorld> world;
  std::shared_ptr<FrameSet> images;

  RunFrame& get() const {
    if (frame == nullptr)
      throw usage_error(
          "this RunFrame ended with its FrameSink.frame(), expected use during that call: keep its report, "
          "images or snapshot()");
    return *frame;
  }
};

struct PyFrameLoop {
  py::object source, should_stop, controller, on_frame;
  std::shared_ptr<PyWorld> world;
  std::vector<py::object> sinks;
  int most_frames = 0;
  RunProgress progress;
  std::vector<Notice> notices;
  int frames = 0, bad_frames = 0, open_frames = 0;
  bool runs = false;

  void expect_rest(const char* call) const {
    if (runs) throw usage_error(std::string(call) + ": this FrameLoop runs, expected a call after its run()");
  }
};

}  // namespace
}  // namespace tactus::python

TACTUS_BOUND(tactus::python::PyFrameSink);
TACTUS_BOUND(tactus::python::PyRunFrame);
TACTUS_BOUND(tactus::python::PyFrameLoop);

namespace tactus::python {
namespace {

/// Holds a world's devices while a loop runs, so that no other thread calls it meanwhile.
class RunningLoop {
 public:
  explicit RunningLoop(PyWorld& world) : world_(world), lock_(hold(world.shared_devices()->calls, "World")) {
    world_.begin_loop();
  }
  ~RunningLoop() { world_.end_loop(is_stepping); }
  RunningLoop(const RunningLoop&) = delete;
  RunningLoop& operator=(const RunningLoop&) = delete;

  /// Calls Python, which may use the world. No thread waits for the devices with Python's lock in its hand.
  template <class F>
  auto call(F&& python) {
    const Pause pause(lock_);
    const py::gil_scoped_acquire hold;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    return python();
  }

  bool is_stepping = false;  ///< images were taken, and their step has not ended

 private:
  class Pause {
   public:
    explicit Pause(std::unique_lock<std::mutex>& lock) : lock_(lock) { lock_.unlock(); }
    ~Pause() { lock_.lock(); }
    Pause(const Pause&) = delete;
    Pause& operator=(const Pause&) = delete;

   private:
    std::unique_lock<std::mutex>& lock_;
  };

  PyWorld& world_;
  std::unique_lock<std::mutex> lock_;
};

template <class T>
T attribute(py::handle object, const char* name, T otherwise) {
  if (!py::hasattr(object, name)) return otherwise;
  const py::object value = object.attr(name);
  try {
    return value.cast<T>();
  } catch (const py::cast_error&) {
    throw usage_error(std::string("the source's ") + name + " is " + kind_of(value) +
                      ", expected what a FrameSource has");
  }
}

/// Without masks: nothing new came. With empty ones alone: no camera delivered.
NextFrame kind_of_frame(const FrameSet& frame, const Rig& rig) {
  const auto is_missing = [](const auto& image) { return image.width_px == 0; };
  if (frame.silhouettes.empty() && frame.depths_m.empty()) return NextFrame::nothing_new;
  if (frame.silhouettes.size() != rig.cameras.size())
    throw usage_error("next_frame() returned a Frame of " + std::to_string(frame.silhouettes.size()) +
                      " masks, expected one for each of the " + std::to_string(rig.cameras.size()) +
                      " cameras of the source's rig");
  const bool is_bad = std::all_of(frame.silhouettes.begin(), frame.silhouettes.end(), is_missing) &&
                      std::all_of(frame.depths_m.begin(), frame.depths_m.end(), is_missing);
  return is_bad ? NextFrame::bad_frame : NextFrame::success;
}

/// Frames of an object of Python with `rig` and next_frame().
class SourceOfPython final : public FrameSource {
 public:
  SourceOfPython(py::handle source, RunningLoop& loop)
      : source_(source),
        loop_(loop),
        rig_(attribute<Rig>(source, "rig", {})),
        frame_count_(attribute<std::optional<int>>(source, "frame_count", {})) {}
  const Rig& rig() const override { return rig_; }
  std::optional<int> frame_count() const override { return frame_count_; }
  NextFrame next(FrameSet& frame) override {
    return loop_.call([&] {
      const py::object next = source_.attr("next_frame")();
      if (next.is_none()) return NextFrame::no_more_data;
      if (!py::isinstance<FrameSet>(next))
        throw usage_error("next_frame() returned " + kind_of(next) +
                          ", expected a Frame, or None at the end");
      frame = next.cast<const FrameSet&>();
      status_ = attribute<std::string>(source_, "status", "");
      return kind_of_frame(frame, rig_);
    });
  }
  std::string status() const override { return status_; }

 private:
  py::handle source_;
  RunningLoop& loop_;
  Rig rig_;
  std::optional<int> frame_count_;
  std::string status_;
};

/// Passes on what a source gives, and asks the controller before each step.
class ControlledSource final : public FrameSource {
 public:
  ControlledSource(FrameSource& source, py::handle controller, py::handle world, RunningLoop& loop)
      : source_(source), controller_(controller), world_(world), loop_(loop) {}
  const Rig& rig() const override { return source_.rig(); }
  std::optional<int> frame_count() const override { return source_.frame_count(); }
  std::optional<double> fps() const override { return source_.fps(); }
  NextFrame next(FrameSet& frame) override {
    const NextFrame next = source_.next(frame);
    has_images_ = has_images_ || next == NextFrame::success;
    // Without images, a filmed world waits for the first ones.
    const bool is_step = next == NextFrame::success ||
                         (next == NextFrame::nothing_new && (has_images_ || rig().cameras.empty()));
    if (is_step && !controller_.is_none()) loop_.call([&] { controller_(world_, frame.time_s); });
    loop_.is_stepping = is_step;
    return next;
  }
  std::string status() const override { return source_.status(); }
  std::string damage() const override { return source_.damage(); }
  const Figure* truth() const override { return source_.truth(); }
  std::string links_json() const override { return source_.links_json(); }

 private:
  FrameSource& source_;
  py::handle controller_, world_;
  RunningLoop& loop_;
  bool has_images_ = false;
};

/// All sinks of a loop, in order.
class SinksOfPython final : public FrameSink {
 public:
  SinksOfPython(PyFrameLoop& all, py::handle world, RunningLoop& loop)
      : all_(all), world_(world), loop_(loop) {}
  void begin(const World&, std::optional<int> frame_count) override {
    loop_.call([&] {
      for (const py::object& sink : all_.sinks) sink.attr("begin")(world_, frame_count);
    });
  }
  void frame(RunFrame& frame) override {
    loop_.is_stepping = false;
    if (all_.sinks.empty() && all_.on_frame.is_none()) return;
    loop_.call([&] {
      if (!all_.on_frame.is_none()) all_.on_frame(world_, frame.report, frame.images.time_s);
      if (all_.sinks.empty()) return;
      const auto shown = std::make_shared<PyRunFrame>(PyRunFrame{&frame, all_.world, nullptr});
      const std::unique_ptr<PyRunFrame, void (*)(PyRunFrame*)> end(shown.get(),
                                                                   [](PyRunFrame* f) { f->frame = nullptr; });
      for (const py::object& sink : all_.sinks) sink.attr("frame")(shown);
    });
  }
  void end(RunNotices& notices) override {
    loop_.call([&] {
      for (const py::object& sink : all_.sinks) sink.attr("end")(notices.notices());
    });
  }

 private:
  PyFrameLoop& all_;
  py::handle world_;
  RunningLoop& loop_;
};

void take_over(const FrameLoop& ran, PyFrameLoop& loop) {
  loop.progress = ran.progress();
  loop.frames += ran.frames();
  loop.bad_frames += ran.bad_frames();
  loop.open_frames += ran.open_frames();
  for (const Notice& notice : ran.notices().notices()) loop.notices.push_back(notice);
}

void run_held(PyFrameLoop& loop, FrameSource& source, RunningLoop& running) {
  const py::object world = py::cast(loop.world);
  ControlledSource controlled(source, loop.controller, world, running);
  SinksOfPython sinks(loop, world, running);
  const auto should_stop = [&] {
    return running.call([&] { return !loop.should_stop.is_none() && loop.should_stop().cast<bool>(); });
  };
  FrameLoop inner(controlled, loop.world->unheld(),
                  {.most_frames = loop.most_frames, .should_stop = should_stop});
  inner.go_on_from(loop.progress);
  inner.add(sinks);
  std::exception_ptr failure;
  {
    const py::gil_scoped_release free;
    try {
      inner.run();
    } catch (...) {
      failure = std::current_exception();
    }
  }
  take_over(inner, loop);
  if (failure) std::rethrow_exception(failure);
}

int run_loop(PyFrameLoop& loop) {
  loop.expect_rest("run");
  const struct Runs {
    bool& is_set;
    explicit Runs(bool& runs) : is_set(runs) { is_set = true; }
    ~Runs() { is_set = false; }
  } runs(loop.runs);
  const int before = loop.frames;
  const std::shared_ptr<PyWorld> world = loop.world;
  RunningLoop running(*world);
  PyFrameSource* const ours =
      py::isinstance<PyFrameSource>(loop.source) ? loop.source.cast<PyFrameSource*>() : nullptr;
  if (ours != nullptr && ours->opened != nullptr) {
    const auto lock = hold(ours->calls, "FrameSource");
    run_held(loop, *ours->opened, running);
  } else {
    SourceOfPython source(loop.source, running);
    run_held(loop, source, running);
  }
  return loop.frames - before;
}

void expect_source(py::handle source) {
  if (!py::hasattr(source, "rig") || !py::hasattr(source, "next_frame"))
    throw usage_error("source is " + kind_of(source) +
                      ", expected a FrameSource, or an object with 'rig' and 'next_frame()'");
}

std::shared_ptr<PyFrameLoop> make_loop(py::object source, std::shared_ptr<PyWorld> world, int most_frames,
                                       py::object should_stop, py::object controller) {
  expect_source(source);
  if (most_frames < 0)
    throw usage_error("most_frames is " + std::to_string(most_frames) +
                      ", expected a number of frames, or 0: all");
  const auto expect_callable = [](const char* argument, const py::object& value) {
    if (!value.is_none() && PyCallable_Check(value.ptr()) == 0)
      throw usage_error(std::string(argument) + " is " + kind_of(value) + ", expected a function, or None");
  };
  expect_callable("should_stop", should_stop);
  expect_callable("controller", controller);
  if (world == nullptr) throw usage_error("world is None, expected a World");
  auto loop = std::make_shared<PyFrameLoop>();
  loop->source = std::move(source);
  loop->world = std::move(world);
  loop->most_frames = most_frames;
  loop->should_stop = std::move(should_stop);
  loop->controller = std::move(controller);
  loop->on_frame = py::none();
  return loop;
}

int run_scene(const PyScene& scene, py::handle devices, const py::function& on_frame, int frames,
              py::object source, py::object controller) {
  if (source.is_none()) {
    auto opened = std::make_shared<PyFrameSource>();
    opened->opened = open_scene_source(scene.scene, scene.path);
    opened->rig = opened->opened->rig();
    source = py::cast(opened);
  }
  expect_source(source);
  const SharedDevices on = devices_of(devices);
  const Rig rig = attribute<Rig>(source, "rig", {});
  std::shared_ptr<PyWorld> world;
  {
    const py::gil_scoped_release free;
    std::unique_lock<std::mutex> lock = hold(on->calls, "Devices");
    const std::shared_ptr<PyPerception> seen = perception_of(on, scene, rig);
    lock.unlock();
    world = std::make_shared<PyWorld>(on, scene, seen);
  }
  const auto loop = make_loop(std::move(source), std::move(world), frames, py::none(), std::move(controller));
  loop->on_frame = on_frame;
  return run_loop(*loop);
}

void bind_sinks(py::module_& m) {
  py::class_<PyRunFrame, std::shared_ptr<PyRunFrame>>(
      m, "RunFrame", "A frame that was simulated, as sinks see it: during FrameSink.frame() alone.")
      .def_property_readonly("world",
                             [](const PyRunFrame& f) {
                               f.get();
                               return f.world;
                             })
      .def_property_readonly(
          "images",
          [](PyRunFrame& f) {
            if (f.images == nullptr) f.images = std::make_shared<FrameSet>(f.get().images);
            return f.images;
          },
          "the Frame; where nothing new came, only its time means something")
      .def_property_readonly("report", [](const PyRunFrame& f) { return StepReport(f.get().report); })
      .def_property_readonly(
          "is_new", [](const PyRunFrame& f) { return f.get().is_new; }, "images came")
      .def_property_readonly(
          "number", [](const PyRunFrame& f) { return f.get().number; }, "of frames of this run, from 1")
      .def_property_readonly(
          "time_s", [](const PyRunFrame& f) { return f.get().images.time_s; }, "on the source's clock")
      .def(
          "snapshot",
          [](const PyRunFrame& f) {
            RunFrame& frame = f.get();
            const py::gil_scoped_release free;
            const PyWorld::Held held = f.world->get();
            return std::const_pointer_cast<FrameSnapshot>(frame.snapshot());
          },
          "Surfaces and bodies, copied to the host once for all sinks.");
  py::class_<PyFrameSink, std::shared_ptr<PyFrameSink>>(
      m, "FrameSink",
      "Sees each frame of a FrameLoop, in the order in which sinks were added. Derive from it.")
      .def(py::init([] { return std::make_shared<PyFrameSink>(); }))
      .def(
          "begin", [](const PyFrameSink&, py::handle, py::handle) {}, py::arg("world"),
          py::arg("frame_count"), "Before the first frame. frame_count: where it is known; else None.")
      .def(
          "frame",
          [](const PyFrameSink&, py::handle) {
            PyErr_SetString(PyExc_NotImplementedError,
                            "a class that derives from FrameSink has a frame(frame)");
            throw py::error_already_set();
          },
          py::arg("frame"), "A RunFrame, which is valid during this call alone.")
      .def(
          "end", [](const PyFrameSink&, py::handle) {}, py::arg("notices"),
          "After the last frame, not after an exception. notices: all of the run, each once.");
}

}  // namespace

void bind_loop(py::module_& m) {
  bind_sinks(m);
  py::class_<PyFrameLoop, std::shared_ptr<PyFrameLoop>>(
      m, "FrameLoop",
      "Takes frames from a source until it ends, lets a world and its Perception make them frames, and "
      "shows each to all sinks.")
      .def(py::init(&make_loop), py::arg("source"), py::arg("world"), py::arg("most_frames") = 0,
           py::arg("should_stop") = py::none(), py::arg("controller") = py::none(),
           "source: a FrameSource, or an object with 'rig' and 'next_frame()'. most_frames: of one run(); "
           "0: all of the source. should_stop(): asked before each frame. controller(world, time_s): called "
           "before the step to time_s, to move obstacles and to set parameters.")
      .def(
          "add",
          [](PyFrameLoop& loop, py::object sink) {
            loop.expect_rest("add");
            if (!py::isinstance<PyFrameSink>(sink))
              throw usage_error("sink is " + kind_of(sink) +
                                ", expected an object of a class that derives from tactus.FrameSink");
            expect_made<PyFrameSink>(sink);
            loop.sinks.push_back(std::move(sink));
          },
          py::arg("sink"), "Sinks see a frame in the order in which they were added.")
      .def(
          "run", &run_loop,
          "Runs to the source's end, or by most_frames. Returns the number of frames. Once more: goes on.\n\n"
          "Raises what the source, the simulation, the controller or a sink raised. Ctrl-C ends it between "
          "two frames. Everything can be used afterwards.")
      .def_property_readonly("world", [](const PyFrameLoop& l) { return l.world; })
      .def_readonly("frames", &PyFrameLoop::frames, "that were simulated")
      .def_readonly("bad_frames", &PyFrameLoop::bad_frames, "that no camera delivered")
      .def_readonly("open_frames", &PyFrameLoop::open_frames,
                    "with a real surface that exceeded its capacity: it is not closed")
      .def_readonly("notices", &PyFrameLoop::notices, "of all runs")
      .def("__repr__", [](const PyFrameLoop& l) {
        return "tactus.FrameLoop(" + std::to_string(l.frames) + " frames, " + std::to_string(l.sinks.size()) +
               " sinks)";
      });
  m.def("run", &run_scene, py::arg("scene"), py::arg("devices") = "auto", py::arg("on_frame"),
        py::arg("frames") = 0, py::arg("source") = py::none(), py::arg("controller") = py::none(),
        "Runs a scene: on_frame(world, report, time_s) after each frame. Returns the number of frames.\n\n"
        "frames: stop after so many; 0: all. source: an object with a 'rig' and 'next_frame()', in place of "
        "the scene's. controller: as a FrameLoop's.");
}

}  // namespace tactus::python

// Independent worlds of one scene, stepped by one call.
#include <pybind11/stl.h>

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <thread>
#include <utility>

#include "module.h"
#include "tactus/base/error.h"
#include "tactus/base/free_memory.h"
#include "tactus/compute/cpu_for.h"
#include "tactus/compute/device.h"

namespace tactus::python {
namespace {

struct PyBatch {
  std::vector<std::shared_ptr<PyWorld>> worlds;
};

}  // namespace
}  // namespace tactus::python

TACTUS_BOUND(tactus::python::PyBatch);

namespace tactus::python {
namespace {

/// That this process took from the heap.
double heap_bytes() {
  const struct mallinfo2 heap = mallinfo2();
  return static_cast<double>(heap.uordblks) + static_cast<double>(heap.hblkhd);
}

double free_bytes(const DeviceSet& devices) {
  if (!devices.is_cuda()) return free_memory_bytes();
  double most = 0;
  for (const DeviceInfo& info : list_devices())
    if (info.spec.kind == DeviceKind::cuda) most = std::max(most, info.memory_bytes);
  return most;
}

std::shared_ptr<PyWorld> copy_of(PyWorld& world, const std::string& state) {
  auto copy = std::make_shared<PyWorld>(std::make_shared<PyDevices>(world.devices().name()),
                                        world.described(), nullptr);
  copy->load_state(state);
  return copy;
}

/// Each world on devices of its own, in the state of `world`. The first one shows how much memory one takes.
PyBatch make_batch(PyWorld& world, std::int64_t count) {
  if (count < 1)
    throw usage_error("count is " + std::to_string(count) + ", expected the number of worlds, 1 or more");
  const std::string state = world.save_state();
  const double before = heap_bytes();
  PyBatch batch{{copy_of(world, state)}};
  // A state holds positions and velocities: a world takes several times as much, on a GPU, too.
  const double world_bytes = std::max(heap_bytes() - before, 4.0 * static_cast<double>(state.size()));
  const double most = 1 + std::floor(0.8 * free_bytes(world.devices()) / world_bytes);
  if (static_cast<double>(count) > most)
    throw usage_error("count is " + std::to_string(count) + ", expected at most " + number_text(most) +
                      ": a world takes " + bytes_text(world_bytes) + ", and " +
                      bytes_text(free_bytes(world.devices())) + " of memory are free");
  batch.worlds.resize(static_cast<std::size_t>(count));
  cpu_for(count - 1, 1,
          [&](std::int64_t k) { batch.worlds[static_cast<std::size_t>(k) + 1] = copy_of(world, state); });
  return batch;
}

/// A frame of all worlds of a batch.
class BatchFrame {
 public:
  BatchFrame(PyBatch& batch, double dt_s, std::optional<std::int64_t> stream)
      : worlds_(batch.worlds),
        dt_s_(dt_s),
        stream_(stream),
        reports_(worlds_.size()),
        failures_(worlds_.size()) {}

  /// One core a world: loops within such a loop run on their thread. The order of a world's arithmetic
  /// doesn't depend on it.
  void step_on_cores() {
    cpu_for(worlds_.size(), 1,
            [this](std::size_t k) { try_one(k, [&] { reports_[k] = worlds_[k]->step(dt_s_, stream_); }); });
  }
  /// A frame of a small world leaves most of a GPU idle, and its host waits for most of the time. So each
  /// thread submits the frames of its worlds, to streams of their own, before it waits for the first.
  void step_at_once() {
    const std::size_t threads = std::min<std::size_t>(
        {worlds_.size(), std::max(1U, std::thread::hardware_concurrency()), kMostThreads});
    cpu_for(threads, 1, [&](std::size_t t) {
      step_share(worlds_.size() * t / threads, worlds_.size() * (t + 1) / threads);
    });
  }
  std::vector<StepReport> reports() {
    for (const std::exception_ptr& failure : failures_)
      if (failure) std::rethrow_exception(failure);
    return std::move(reports_);
  }

 private:
  /// A driver takes most kinds of call one at a time.
  static constexpr std::size_t kMostThreads = 16;

  template <class F>
  void try_one(std::size_t k, const F& f) {
    try {
      f();
    } catch (...) {
      failures_[k] = std::current_exception();
    }
  }
  void step_share(std::size_t first, std::size_t last) {
    std::vector<std::pair<std::size_t, PyWorld::Held>> open;
    for (std::size_t k = first; k < last; ++k)
      try_one(k, [&] {
        PyWorld::Held held = worlds_[k]->get();
        worlds_[k]->begin_step(dt_s_, stream_);
        open.emplace_back(k, std::move(held));
      });
    while (!open.empty())
      std::erase_if(open, [&](const auto& world) {
        const std::size_t k = world.first;
        bool has_ended = true;
        try_one(k, [&] {
          std::optional<StepReport> report = worlds_[k]->continue_step();
          has_ended = report.has_value();
          if (report) reports_[k] = *std::move(report);
        });
        return has_ended;
      });
  }

  const std::vector<std::shared_ptr<PyWorld>>& worlds_;
  double dt_s_;
  std::optional<std::int64_t> stream_;
  std::vector<StepReport> reports_;
  std::vector<std::exception_ptr> failures_;
};

std::vector<StepReport> step(PyBatch& batch, double dt_s, std::optional<std::int64_t> stream) {
  BatchFrame frame(batch, dt_s, stream);
  if (batch.worlds.front()->devices().device(0).kind() == DeviceKind::cpu)
    frame.step_on_cores();
  else
    frame.step_at_once();
  return frame.reports();
}

std::shared_ptr<PyWorld> world_at(const PyBatch& batch, py::ssize_t k) {
  const auto count = static_cast<py::ssize_t>(batch.worlds.size());
  if (k < -count || k >= count)
    throw py::index_error("world " + std::to_string(k) + " of a batch of " + std::to_string(count));
  return batch.worlds[static_cast<std::size_t>(k < 0 ? k + count : k)];
}

}  // namespace

void bind_batch(py::module_& m) {
  constexpr auto kNoGil = py::call_guard<py::gil_scoped_release>();
  py::class_<PyBatch>(m, "Batch", "Independent worlds of one scene, made by World.batch().")
      .def("step", &step, py::arg("dt_s"), py::arg("stream") = py::none(), kNoGil,
           "One frame of dt_s [s] of every world: on all cores, or at once on a GPU. Their StepReports, in "
           "order. Each world has the bits that it has alone. stream: as World.step's.\n\nRaises the first "
           "Error of a world; the others were stepped.")
      .def("__len__", [](const PyBatch& batch) { return batch.worlds.size(); })
      .def("__getitem__", &world_at)
      .def("__repr__", [](const PyBatch& batch) {
        return "tactus.Batch(" + std::to_string(batch.worlds.size()) + " worlds)";
      });
  const py::object world = m.attr("World");
  world.attr("batch") = py::cpp_function(
      &make_batch, py::name("batch"), py::is_method(world), py::arg("count"), kNoGil,
      "So many independent worlds of this world's scene, in its state: a Batch.\n\n"
      "Raises Error for a world with cameras, and before memory runs out for more worlds than fit in it.");
}

}  // namespace tactus::python

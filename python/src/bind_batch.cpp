// Independent worlds of one scene, stepped by one call.
#include <pybind11/stl.h>

#include <exception>

#include "module.h"
#include "tactus/base/error.h"
#include "tactus/compute/cpu_for.h"

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

/// Each world on devices of its own, in the state of `world`.
PyBatch make_batch(PyWorld& world, int count) {
  if (count < 1)
    throw usage_error("count is " + std::to_string(count) + ", expected the number of worlds, 1 or more");
  const std::string state = world.save_state();
  PyBatch batch;
  for (int k = 0; k < count; ++k) {
    batch.worlds.push_back(std::make_shared<PyWorld>(std::make_shared<PyDevices>(world.devices().name()),
                                                     world.described(), nullptr));
    batch.worlds.back()->load_state(state);
  }
  return batch;
}

/// Worlds on the CPU share its cores, one thread a world: loops within such a loop run on their thread. The
/// order of a world's arithmetic doesn't depend on it.
std::vector<StepReport> step(PyBatch& batch, double dt_s) {
  std::vector<StepReport> reports(batch.worlds.size());
  std::vector<std::exception_ptr> failures(batch.worlds.size());
  const auto step_one = [&](std::size_t k) {
    try {
      reports[k] = batch.worlds[k]->step(dt_s);
    } catch (...) {
      failures[k] = std::current_exception();
    }
  };
  if (batch.worlds.front()->devices().is_cuda())
    for (std::size_t k = 0; k < batch.worlds.size(); ++k) step_one(k);
  else
    cpu_for(batch.worlds.size(), 1, step_one);
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
  return reports;
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
      .def("step", &step, py::arg("dt_s"), kNoGil,
           "One frame of dt_s [s] of every world, on all cores. Their StepReports, in order. Each world has "
           "the bits that it has alone.\n\nRaises the first Error of a world; the others were stepped.")
      .def("__len__", [](const PyBatch& batch) { return batch.worlds.size(); })
      .def("__getitem__", &world_at)
      .def("__repr__", [](const PyBatch& batch) {
        return "tactus.Batch(" + std::to_string(batch.worlds.size()) + " worlds)";
      });
  const py::object world = m.attr("World");
  world.attr("batch") =
      py::cpp_function(&make_batch, py::name("batch"), py::is_method(world), py::arg("count"), kNoGil,
                       "So many independent worlds of this world's scene, in its state: a Batch.\n\n"
                       "Raises Error for a world with cameras.");
}

}  // namespace tactus::python

// Pictures of worlds.
#include <pybind11/stl.h>

#include "arrays.h"
#include "module.h"
#include "tactus/run/sinks.h"
#include "tactus/sim/scene.h"

namespace tactus::python {
namespace {

py::array_t<std::uint8_t> show(PyWorld& world, std::pair<Index, Index> size_px) {
  ColorImage image;
  {
    const py::gil_scoped_release free;
    const PyWorld::Held held = world.get();
    PyPerception* const seen = world.perception().get();
    Scene scene = world.scene();
    scene.view.size_px.x = size_px.first;
    scene.view.size_px.y = size_px.second;
    image = picture_of(*held, std::move(scene), seen != nullptr ? seen->rig : Rig(), world.assets());
  }
  py::array_t<std::uint8_t> pixels(
      {static_cast<py::ssize_t>(image.height_px), static_cast<py::ssize_t>(image.width_px), py::ssize_t{3}});
  std::copy_n(&image.pixels.data()->r, pixels.size(), pixels.mutable_data());
  return pixels;
}

}  // namespace

void bind_view(py::module_& m) {
  const py::object world = m.attr("World");
  world.attr("show") = py::cpp_function(
      &show, py::name("show"), py::is_method(world), py::arg("size_px") = std::pair<Index, Index>(960, 540),
      "A picture of the world as the scene's 'view' looks at it: (height, width, 3) uint8, sRGB.\n\n"
      "size_px: (width, height), 16 to 8192. Raises Error where there is no OpenGL 4.5.");
}

}  // namespace tactus::python

// Scenes and meshes.
#include <cmath>
#include <cstdio>

#include "arrays.h"
#include "module.h"
#include "tactus/base/byte_io.h"
#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/geom/mesh/mesh.h"
#include "tactus/io/mesh/mesh_file.h"
#include "tactus/io/scene_file.h"

namespace tactus::python {
namespace {

/// JSON is YAML, so a dict goes through the same schema with the same messages.
PyScene scene_of(py::handle source) {
  if (py::isinstance<py::dict>(source)) {
    auto scene = py::reinterpret_borrow<py::dict>(source);
    if (!scene.contains("source")) {  // nobody films it
      scene = py::dict(scene.attr("copy")());
      scene["source"] = py::dict(py::arg("kind") = "none");
    }
    const py::object dumps = py::module_::import("json").attr("dumps");
    const auto text = py::str(dumps(scene, py::arg("indent") = 1)).cast<std::string>();
    return {parse_scene(text, "dict"), "dict", fnv1a(text)};
  }
  if (!py::isinstance<py::str>(source) && !py::hasattr(source, "__fspath__"))
    throw usage_error("source is " + kind_of(source) + ", expected the path of a scene file or a dict");
  const auto path = py::str(source).cast<std::string>();
  return {read_scene(path), path, fnv1a(read_file(path, kMaxYamlBytes))};
}

std::shared_ptr<TriangleMesh> mesh_of(py::handle positions_m, py::handle triangles) {
  const std::string of_positions = "a (vertices, 3) array of float32 [m]";
  const std::string of_triangles = "a (triangles, 3) array of int32";
  const auto points = rows_of<float>("positions", positions_m, 2, of_positions);
  const auto corners = rows_of<std::int32_t>("triangles", triangles, 2, of_triangles);
  if (points.shape(1) != 3) refuse("positions", positions_m, of_positions);
  if (corners.shape(1) != 3) refuse("triangles", triangles, of_triangles);
  for (py::ssize_t v = 0; v < points.shape(0); ++v)
    if (!std::isfinite(points.at(v, 0) + points.at(v, 1) + points.at(v, 2)))
      throw usage_error("positions[" + std::to_string(v) + "] is not finite, expected metres");
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->positions_m.resize(static_cast<std::size_t>(points.shape(0)));
  if (points.size() > 0) std::copy_n(points.data(), points.size(), &mesh->positions_m.data()->x);
  for (py::ssize_t t = 0; t < corners.shape(0); ++t) {
    for (int k = 0; k < 3; ++k)
      if (const std::int32_t i = corners.at(t, k); i < 0 || i >= points.shape(0))
        throw usage_error("triangles[" + std::to_string(t) + "] names vertex " + std::to_string(i) +
                          ", expected one of the " + std::to_string(points.shape(0)));
    mesh->triangles.push_back({corners.at(t, 0), corners.at(t, 1), corners.at(t, 2)});
  }
  return mesh;
}

void bind_mesh(py::module_& m) {
  py::class_<TriangleMesh, std::shared_ptr<TriangleMesh>>(
      m, "Mesh", "Triangles. Arrays are views of the mesh, which lives as long as they do.")
      .def(py::init(&mesh_of), py::arg("positions"), py::arg("triangles"),
           "positions: (vertices, 3) float32 [m]. triangles: (triangles, 3) int32.")
      .def_property_readonly(
          "positions", [](py::object self) { return view_of(self.cast<TriangleMesh&>().positions_m, self); },
          "(vertices, 3) float32 [m], world")
      .def_property_readonly(
          "normals", [](py::object self) { return view_of(self.cast<TriangleMesh&>().normals, self); },
          "(vertices, 3) float32, unit; (0, 3) where there are none")
      .def_property_readonly(
          "triangles",
          [](py::object self) {
            const TriangleMesh& mesh = self.cast<TriangleMesh&>();
            return view_of(reinterpret_cast<const std::int32_t*>(mesh.triangles.data()),
                           {static_cast<py::ssize_t>(mesh.triangles.size()), 3}, self);
          },
          "(triangles, 3) int32, counterclockwise from outside")
      .def_property_readonly("volume_m3", [](const TriangleMesh& mesh) { return volume_m3(mesh); })
      .def(
          "write_ply", [](const TriangleMesh& mesh, const std::string& path) { write_ply(path, mesh); },
          py::arg("path"))
      .def("__repr__", [](const TriangleMesh& mesh) {
        return "tactus.Mesh(" + std::to_string(mesh.positions_m.size()) + " vertices, " +
               std::to_string(mesh.triangles.size()) + " triangles)";
      });
}

}  // namespace

void bind_scene(py::module_& m) {
  bind_mesh(m);
  py::class_<PyScene>(m, "Scene", "A scene, checked by the schema of docs/scene.md.")
      .def(py::init(&scene_of), py::arg("source"),
           "From the path of a scene file, or from a dict with the same keys; without 'source', nobody "
           "films.\n\n"
           "Raises Error for the first thing wrong in it: file, line, value, what was expected.")
      .def_property_readonly("name", [](const PyScene& s) { return s.scene.name; })
      .def_property_readonly("bodies",
                             [](const PyScene& s) {
                               py::list names;
                               for (const BodyDescription& b : s.scene.bodies) names.append(b.name);
                               return names;
                             })
      .def("__repr__", [](const PyScene& s) {
        return "tactus.Scene('" + s.path + "', " + std::to_string(s.scene.bodies.size()) + " bodies, " +
               std::to_string(s.scene.obstacles.size()) + " obstacles" +
               (s.scene.fluid ? ", a liquid)" : ")");
      });
}

}  // namespace tactus::python

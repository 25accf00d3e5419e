// Results of frames: reports, snapshots, strokes of blades.
#include <pybind11/stl.h>

#include "arrays.h"
#include "module.h"

namespace tactus::python {
namespace {

template <class T>
std::shared_ptr<TriangleMesh> part_of(const std::shared_ptr<T>& owner, const TriangleMesh& mesh) {
  return {owner, const_cast<TriangleMesh*>(&mesh)};  // pybind11 knows no const; its arrays are read-only
}

std::vector<std::shared_ptr<TriangleMesh>> parts_of(const std::shared_ptr<FrameSnapshot>& owner,
                                                    const std::vector<TriangleMesh>& meshes) {
  std::vector<std::shared_ptr<TriangleMesh>> all;
  for (const TriangleMesh& mesh : meshes) all.push_back(part_of(owner, mesh));
  return all;
}

py::dict hull_of(const StepReport& report) {
  py::dict hull;
  hull["vertices"] = report.hull.vertices;
  hull["triangles"] = report.hull.triangles;
  hull["overflow"] = report.hull.overflow ? report.hull.overflow->text() : "";
  return hull;
}

py::dict liquid_of(const StepReport& report) {
  const LiquidReport& of = report.liquid;
  py::dict liquid;
  liquid["here"] = of.here;
  liquid["placed"] = of.placed;
  liquid["emitted"] = of.emitted;
  liquid["taken"] = of.taken;
  liquid["replaced"] = of.replaced;
  liquid["waiting"] = of.waiting;
  liquid["fastest_m_s"] = of.fastest_m_s;
  liquid["waiting_m3"] = report.liquid_waiting_m3;
  liquid["film_m3"] = report.film.film_m3;
  liquid["stain_m3"] = report.film.stain_m3;
  return liquid;
}

void bind_reports(py::module_& m) {
  py::class_<Notice>(m, "Notice", "Something that a frame has to say.")
      .def_readonly("code", &Notice::code, "stable, for programs: 'hull.overflow'")
      .def_property_readonly("severity", [](const Notice& n) { return severity_text(n.severity); })
      .def_readonly("text", &Notice::text)
      .def_readonly("remedy", &Notice::remedy)
      .def("__repr__",
           [](const Notice& n) { return std::string(severity_text(n.severity)) + ": " + n.message(); });
  py::class_<BodyContact>(m, "Reaction", "Of a body on a thing that it touched, over a frame.")
      .def_readonly("body", &BodyContact::body)
      .def_readonly("other", &BodyContact::component,
                    "a component of the real surface by its label, an obstacle or a body by its name")
      .def_property_readonly(
          "force_N", [](const BodyContact& c) { return array_of(vec_cast<double>(c.reaction.force_N)); },
          "(3,) mean force on the other thing, world")
      .def_property_readonly(
          "impulse_N_s",
          [](const BodyContact& c) { return array_of(vec_cast<double>(c.reaction.impulse_N_s)); })
      .def("__repr__",
           [](const BodyContact& c) { return "tactus.Reaction('" + c.body + "' on '" + c.component + "')"; });
  py::class_<StepReport>(m, "StepReport", "How a frame went.")
      .def_readonly("substeps", &StepReport::substeps)
      .def_readonly("liquid_steps", &StepReport::liquid_steps)
      .def_readonly("settling_substeps", &StepReport::settling_substeps,
                    "before the first frame, where 'frame.start' is settled")
      .def_readonly("dt_s", &StepReport::dt_s, "simulated")
      .def_property_readonly(
          "grab_N", [](const StepReport& r) { return array_of(r.grab_N); },
          "(3,) mean force of a grab on its body")
      .def_property_readonly(
          "hull", &hull_of, "of the real surface: vertices, triangles, and overflow ('' where there is none)")
      .def_property_readonly("liquid", &liquid_of,
                             "particles: here, placed, emitted, taken, replaced, waiting; fastest_m_s, "
                             "waiting_m3, film_m3, stain_m3")
      .def_property_readonly(
          "liquid_forces",
          [](const StepReport& r) {
            py::list all;
            for (const LiquidReaction& f : r.liquid_forces)
              all.append(py::make_tuple(f.on, array_of(vec_cast<double>(f.force_N))));
            return all;
          },
          "(name, (3,) mean force [N]) of all that the liquid touched: 'face -y', an obstacle, a body, ..")
      .def_readonly("contacts", &StepReport::contacts)
      .def_readonly("notices", &StepReport::notices)
      .def(
          "force_N",
          [](const StepReport& r, const std::string& other) {
            Vec3d sum{};
            for (const BodyContact& c : r.contacts)
              if (c.component == other) sum += vec_cast<double>(c.reaction.force_N);
            return array_of(sum);
          },
          py::arg("other"), "(3,) mean force of all bodies on a thing; 0 where nothing touches it")
      .def("__repr__", [](const StepReport& r) {
        return "tactus.StepReport(" + std::to_string(r.substeps) + " substeps, " +
               std::to_string(r.contacts.size()) + " contacts, " + std::to_string(r.notices.size()) +
               " notices)";
      });
  py::class_<BodyMonitors>(m, "Monitors", "Of a body as a whole.")
      .def_readonly("kinetic_J", &BodyMonitors::kinetic_J)
      .def_readonly("elastic_J", &BodyMonitors::elastic_J)
      .def_readonly("volume_m3", &BodyMonitors::volume_m3)
      .def_readonly("min_J", &BodyMonitors::min_J, "smallest ratio of a cube's volume to that at rest")
      .def_readonly("inverted_cubes", &BodyMonitors::inverted_cubes)
      .def_property_readonly("momentum_kg_m_s",
                             [](const BodyMonitors& b) { return array_of(b.momentum_kg_m_s); })
      .def_property_readonly("angular_momentum_kg_m2_s",
                             [](const BodyMonitors& b) { return array_of(b.angular_momentum_kg_m2_s); });
}

void bind_snapshot(py::module_& m) {
  py::class_<FrameSnapshot, std::shared_ptr<FrameSnapshot>>(m, "Snapshot",
                                                            "Meshes of a frame: they stay as they are.")
      .def_property_readonly(
          "real", [](const std::shared_ptr<FrameSnapshot>& s) { return part_of(s, s->real); },
          "the reconstructed surface")
      .def_property_readonly(
          "bodies", [](const std::shared_ptr<FrameSnapshot>& s) { return parts_of(s, s->bodies); },
          "in the scene's order")
      .def_property_readonly(
          "obstacles", [](const std::shared_ptr<FrameSnapshot>& s) { return parts_of(s, s->obstacles); },
          "those that move, in the scene's order")
      .def_property_readonly(
          "blades", [](const std::shared_ptr<FrameSnapshot>& s) { return parts_of(s, s->blades); },
          "held ones, as in the scene; then tracked ones; then others")
      .def_property_readonly(
          "tools",
          [](const FrameSnapshot& s) {
            py::list all;
            for (const ToolAxis& tool : s.tools)
              all.append(py::make_tuple(tool.name, blade_state_name(tool.state),
                                        array_of(vec_cast<double>(tool.from_m)),
                                        array_of(vec_cast<double>(tool.to_m)), tool.two_sigma_m));
            return all;
          },
          "(name, state, from_m, to_m, two_sigma_m) of tracked tools that were found: their longest axis")
      .def_property_readonly(
          "liquid", [](py::object self) { return view_of(self.cast<FrameSnapshot&>().liquid_m, self); },
          "(particles, 3) float32 [m]");
}

void bind_strokes(py::module_& m) {
  py::class_<StrokeResult>(m, "StrokeResult", "A stroke of a blade in a body so far.")
      .def_property_readonly("blade", [](const StrokeResult& r) { return r.score.blade; })
      .def_property_readonly("body", [](const StrokeResult& r) { return r.score.body; })
      .def_property_readonly(
          "stroke", [](const StrokeResult& r) { return r.score.stroke; }, "of the body: 0, 1, ..")
      .def_property_readonly(
          "path_m", [](const StrokeResult& r) { return r.score.path_m; }, "of the middle of the edge")
      .def_property_readonly(
          "depth_m", [](const StrokeResult& r) { return r.score.depth_m; },
          "of the deepest point of the incision below the surface, at rest")
      .def_property_readonly(
          "area_m2", [](const StrokeResult& r) { return r.score.area_m2; }, "of one side, at rest")
      .def_property_readonly("begin_s", [](const StrokeResult& r) { return r.score.begin_s; })
      .def_property_readonly("end_s", [](const StrokeResult& r) { return r.score.end_s; })
      .def_property_readonly("cut_cubes", [](const StrokeResult& r) { return r.score.cut_cubes; })
      .def_property_readonly(
          "due_m3", [](const StrokeResult& r) { return r.score.due_m3; }, "blood, out or held back")
      .def_property_readonly(
          "bled_m3", [](const StrokeResult& r) { return r.score.bled_m3; }, "the part that came out")
      .def_readonly("skin_length_m", &StrokeResult::skin_length_m)
      .def_readonly("plan", &StrokeResult::plan, "that it kept to best; '' where there is none")
      .def_property_readonly(
          "deviation",
          [](const StrokeResult& r) -> py::object {
            if (!r.deviation) return py::none();
            py::dict of;
            of["mean_m"] = r.deviation->mean_m;
            of["max_m"] = r.deviation->max_m;
            of["followed_m"] = r.deviation->followed_m;
            of["beyond_m"] = r.deviation->beyond_m;
            return of;
          },
          "from the plan: mean_m, max_m, followed_m, beyond_m; or None")
      .def_readonly("peak_force_N", &StrokeResult::peak_force_N,
                    "of a body whose 'cut_energy_j_m2' is known; or None")
      .def("__repr__", [](const StrokeResult& r) {
        return "tactus.StrokeResult('" + r.score.blade + "' in '" + r.score.body + "')";
      });
}

}  // namespace

void bind_results(py::module_& m) {
  bind_reports(m);
  bind_snapshot(m);
  bind_strokes(m);
}

}  // namespace tactus::python

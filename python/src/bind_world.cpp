// The world: soft bodies, liquid and obstacles, stepped frame by frame.
#include <pybind11/stl.h>

#include <cmath>
#include <string_view>

#include "arrays.h"
#include "module.h"
#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"
#include "tactus/world/world.h"

namespace tactus::python {
namespace {

/// Reads and sets parameters as a dict does.
struct PyParameters {
  std::shared_ptr<PyWorld> world;
};

}  // namespace
}  // namespace tactus::python

TACTUS_BOUND(tactus::python::PyParameters);

namespace tactus::python {

PyWorld::PyWorld(SharedDevices devices, PyScene scene, std::shared_ptr<PyPerception> perception)
    : devices_(std::move(devices)),
      scene_(std::move(scene)),
      assets_(load_body_assets(scene_.scene)),
      perception_(std::move(perception)) {
  if (perception_ != nullptr && perception_->has_world)
    throw usage_error("perception belongs to another World: expected one of its own");
  if (perception_ != nullptr && perception_->devices != devices_)
    throw usage_error("perception is on other devices than this World: expected the same Devices object");
  const auto lock = hold(devices_->calls, "World");
  world_ = std::make_unique<World>(*devices_, scene_.scene, assets_,
                                   perception_ != nullptr ? perception_->made.get() : nullptr);
  if (perception_ != nullptr) perception_->has_world = true;
}

void PyWorld::set_surface(const Observation& seen) {
  const Held world = get();
  world->set_surface(seen);
  if (seen.is_new) lost_images_ = false;
}

StepReport PyWorld::step(double dt_s) {
  if (!(dt_s >= 0 && std::isfinite(dt_s)))
    throw usage_error("dt_s is " + number_text(dt_s) +
                      ", expected the time since the last frame [s], 0 or more");
  const Held world = get();
  if (lost_images_)
    throw usage_error(
        "step: a loop failed with this World's last images, expected set_surface() with new "
        "ones before");
  StepReport report = world->step(dt_s);
  if (perception_ != nullptr) perception_->frame.reset();
  return report;
}

void PyWorld::end_loop(bool lost_images) {
  --loops_;
  lost_images_ = perception_ != nullptr && lost_images;
}

namespace {

/// Before the state: bytes that say of which scene it is.
constexpr std::string_view kStateWord = "TACTUSPY";

std::string state_head(const PyScene& scene, int devices) {
  std::string head(kStateWord);
  for (int k = 0; k < 8; ++k) head += static_cast<char>(scene.hash >> (8 * k) & 0xffU);
  return head + static_cast<char>(devices);
}

}  // namespace

std::string PyWorld::save_state() {
  if (perception_ != nullptr)
    throw usage_error("save_state: the state of a world with cameras needs its last images: use a recording");
  return state_head(scene_, devices_->count()) + get()->save_state();
}

/// Cuts that are read are done once more, in a body that has none.
void PyWorld::load_state(const std::string& bytes) {
  if (perception_ != nullptr) throw usage_error("load_state: of a world without cameras only");
  const std::string head = state_head(scene_, devices_->count());
  if (bytes.compare(0, kStateWord.size(), kStateWord) != 0)
    throw usage_error("load_state: state is no state of a World, expected the bytes of save_state()");
  if (bytes.compare(0, head.size() - 1, head, 0, head.size() - 1) != 0)
    throw usage_error(
        "load_state: state is of another scene, or this scene was edited since: expected a "
        "state of " +
        scene_.path + " as it is");
  if (bytes.compare(0, head.size(), head) != 0)
    throw usage_error("load_state: state is of another number of devices, expected one of " +
                      devices_->name());
  const Held held = get();
  if (!world_->cuts().empty()) {
    if (loops_ > 0)
      throw usage_error(
          "load_state: this World was cut and is in a FrameLoop, which goes on with it: expected a call "
          "after run()");
    world_ = std::make_unique<World>(*devices_, scene_.scene, assets_);
  }
  world_->load_state(bytes.substr(head.size()));
}

namespace {

constexpr auto kNoGil = py::call_guard<py::gil_scoped_release>();

template <class T>
std::shared_ptr<TriangleMesh> part_of(const std::shared_ptr<T>& owner, const TriangleMesh& mesh) {
  return {owner, const_cast<TriangleMesh*>(&mesh)};  // pybind11 knows no const; its arrays are read-only
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
      .def_readonly("dt_s", &StepReport::dt_s, "simulated")
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
          "bodies",
          [](const std::shared_ptr<FrameSnapshot>& s) {
            std::vector<std::shared_ptr<TriangleMesh>> all;
            for (const TriangleMesh& mesh : s->bodies) all.push_back(part_of(s, mesh));
            return all;
          },
          "in the scene's order")
      .def_property_readonly(
          "obstacles",
          [](const std::shared_ptr<FrameSnapshot>& s) {
            std::vector<std::shared_ptr<TriangleMesh>> all;
            for (const TriangleMesh& mesh : s->obstacles) all.push_back(part_of(s, mesh));
            return all;
          },
          "those that move, in the scene's order")
      .def_property_readonly(
          "liquid", [](py::object self) { return view_of(self.cast<FrameSnapshot&>().liquid_m, self); },
          "(particles, 3) float32 [m]");
}

/// Arrays, one entry a contact.
py::dict contacts_of(PyWorld& world, const std::string& body) {
  const PyWorld::Held held = world.get();
  const std::vector<BodyPointContact>& all = held->contacts(body);
  const auto n = static_cast<py::ssize_t>(all.size());
  py::array_t<std::int32_t> point(n);
  py::array_t<float> gap_m(n), normal_N_s(n), position_m({n, py::ssize_t{3}}), normal({n, py::ssize_t{3}}),
      impulse_N_s({n, py::ssize_t{3}});
  py::list other, kind, state;
  for (py::ssize_t i = 0; i < n; ++i) {
    const BodyPointContact& c = all[static_cast<std::size_t>(i)];
    point.mutable_at(i) = c.point;
    gap_m.mutable_at(i) = c.gap_m;
    normal_N_s.mutable_at(i) = c.normal_N_s;
    for (int a = 0; a < 3; ++a) {
      position_m.mutable_at(i, a) = c.point_m[a];
      normal.mutable_at(i, a) = c.normal[a];
      impulse_N_s.mutable_at(i, a) = c.impulse_N_s[a];
    }
    other.append(c.other);
    kind.append(kind_text(c.kind));
    state.append(state_text(c.state));
  }
  py::dict contacts;
  contacts["point"] = point;
  contacts["position_m"] = position_m;
  contacts["normal"] = normal;
  contacts["gap_m"] = gap_m;
  contacts["impulse_N_s"] = impulse_N_s;
  contacts["normal_N_s"] = normal_N_s;
  contacts["other"] = other;
  contacts["kind"] = kind;
  contacts["state"] = state;
  return contacts;
}

const SceneParameter& parameter(const PyParameters& all, const std::string& name) {
  all.world->get()->parameters().get(name);  // throws where it isn't there
  const auto list = all.world->get()->parameters().list();
  return *std::find_if(list.begin(), list.end(), [&](const SceneParameter& p) { return p.name == name; });
}

py::list names_of(const PyParameters& all) {
  py::list names;
  for (const SceneParameter& p : all.world->get()->parameters().list()) names.append(p.name);
  return names;
}

void bind_parameters(py::module_& m) {
  py::class_<SceneParameter>(m, "Parameter", "A number of the scene that may change while it runs.")
      .def_readonly("name", &SceneParameter::name)
      .def_readonly("unit", &SceneParameter::unit)
      .def_readonly("meaning", &SceneParameter::meaning)
      .def_readonly("value", &SceneParameter::value)
      .def_readonly("least", &SceneParameter::least)
      .def_readonly("most", &SceneParameter::most)
      .def("__repr__", [](const SceneParameter& p) {
        return "tactus.Parameter('" + p.name + "' = " + number_text(p.value) + ", " + p.range_text() + ")";
      });
  py::class_<PyParameters>(m, "Parameters", "What may change while a scene runs, by the scene file's names.")
      .def("__getitem__", [](const PyParameters& all,
                             const std::string& name) { return all.world->get()->parameters().get(name); })
      .def("__setitem__", [](const PyParameters& all, const std::string& name,
                             double x) { all.world->get()->parameters().set(name, x); })
      .def("__len__", [](const PyParameters& all) { return all.world->get()->parameters().list().size(); })
      .def("__contains__",
           [](const PyParameters& all, const std::string& name) {
             const auto list = all.world->get()->parameters().list();
             return std::any_of(list.begin(), list.end(),
                                [&](const SceneParameter& p) { return p.name == name; });
           })
      .def("__iter__", [](const PyParameters& all) { return py::iter(names_of(all)); })
      .def("keys", &names_of)
      .def("describe", &parameter, py::arg("name"), "Its unit, range and meaning.");
}

py::dict probes_of(PyWorld& world) {
  std::vector<ProbeReading> readings;
  {
    const py::gil_scoped_release free;
    readings = world.get()->probes();
  }
  py::dict probes;
  for (std::size_t p = 0; p < readings.size(); ++p) {
    py::dict one;
    one["position_m"] = array_of(vec_cast<double>(readings[p].position_m));
    one["green_strain"] = array_of(readings[p].strain.strain);
    one["cauchy_stress_Pa"] = array_of(readings[p].strain.stress_Pa);
    probes[py::str(world.scene().probes[p].name)] = one;
  }
  return probes;
}

std::vector<Vec3f> nodes_of(PyWorld& world, const std::string& body, bool velocities) {
  BodyNodes nodes = world.get()->nodes(body);
  return velocities ? std::move(nodes.velocities_m_s) : std::move(nodes.positions_m);
}

py::array node_array(PyWorld& world, const std::string& body, bool velocities) {
  auto* nodes = new std::vector<Vec3f>;
  const py::capsule owner(nodes, [](void* p) { delete static_cast<std::vector<Vec3f>*>(p); });
  {
    const py::gil_scoped_release free;
    *nodes = nodes_of(world, body, velocities);
  }
  return view_of(*nodes, owner);
}

std::shared_ptr<PyWorld> make_world(py::handle devices, const PyScene& scene,
                                    std::shared_ptr<PyPerception> perception) {
  SharedDevices on = perception != nullptr && py::isinstance<py::str>(devices) &&
                             devices.cast<std::string>() == perception->devices->name()
                         ? perception->devices
                         : devices_of(devices);
  const py::gil_scoped_release free;
  return std::make_shared<PyWorld>(std::move(on), scene, std::move(perception));
}

}  // namespace

void bind_world(py::module_& m) {
  bind_reports(m);
  bind_snapshot(m);
  bind_parameters(m);
  py::class_<PyWorld, std::shared_ptr<PyWorld>>(m, "World", "Soft bodies, liquid and obstacles of a scene.")
      .def(py::init(&make_world), py::arg("devices"), py::arg("scene"), py::arg("perception") = nullptr,
           "devices: 'cpu', 'cuda:0', .. or a Devices. perception: where cameras see something; its Devices.")
      .def("step", &PyWorld::step, py::arg("dt_s"), kNoGil,
           "One frame of dt_s [s] since the last one. Other Python threads run meanwhile.")
      .def("set_surface", &PyWorld::set_surface, py::arg("observation"),
           "The next step has the surface of these images.")
      .def(
          "set_pose",
          [](PyWorld& w, const std::string& obstacle, py::handle T) {
            w.get()->set_pose(obstacle, rigid_of("T_world_obstacle", T));
          },
          py::arg("obstacle"), py::arg("T_world_obstacle"),
          "Where an obstacle with 'held: true' is at the end of the next frame: (4, 4), [m].")
      .def(
          "pose",
          [](const std::shared_ptr<PyWorld>& w, const std::string& obstacle) {
            return array_of(w->get()->pose(obstacle));
          },
          py::arg("obstacle"), "(4, 4)")
      .def_property_readonly("parameters", [](const std::shared_ptr<PyWorld>& w) { return PyParameters{w}; })
      .def(
          "report_contacts", [](PyWorld& w, const std::string& body) { w.get()->report_contacts(body); },
          py::arg("body"), "From the next frame on, contacts() has those of this body.")
      .def("contacts", &contacts_of, py::arg("body"),
           "Of the last frame, as arrays with one entry a contact: point, position_m, normal (towards the "
           "body), "
           "gap_m, impulse_N_s (on the body), normal_N_s, other, kind, state.")
      .def(
          "snapshot", [](PyWorld& w) { return std::make_shared<FrameSnapshot>(w.get()->snapshot()); }, kNoGil,
          "Surfaces and particles as they are now.")
      .def(
          "positions", [](PyWorld& w, const std::string& body) { return node_array(w, body, false); },
          py::arg("body"), "(nodes, 3) float32 [m] of a body's lattice")
      .def(
          "velocities", [](PyWorld& w, const std::string& body) { return node_array(w, body, true); },
          py::arg("body"), "(nodes, 3) float32 [m/s]")
      .def(
          "monitors", [](PyWorld& w) { return w.get()->monitors(); }, kNoGil,
          "Of every body, in the scene's order.")
      .def("probes", &probes_of, "By name: position_m (3,), green_strain and cauchy_stress_Pa (3, 3).")
      .def(
          "state_hash", [](PyWorld& w) { return state_hash(*w.get()); }, kNoGil,
          "Of all positions and velocities: the same on every set of devices.")
      .def(
          "save_state",
          [](PyWorld& w) {
            std::string state;
            {
              const py::gil_scoped_release free;
              state = w.save_state();
            }
            return py::bytes(state);
          },
          "All that the coming frames depend on. For load_state() of a World of the same scene and devices.")
      .def(
          "load_state",
          [](PyWorld& w, const py::bytes& state) {
            const std::string bytes = state;
            const py::gil_scoped_release free;
            w.load_state(bytes);
          },
          py::arg("state"),
          "The state that save_state() gave.\n\nRaises Error for the state of another scene, an edited one, "
          "or one that was cut short.")
      .def_property_readonly("bodies",
                             [](PyWorld& w) {
                               py::list names;
                               for (const BodyDescription& b : w.scene().bodies) names.append(b.name);
                               return names;
                             })
      .def("__repr__", [](PyWorld& w) {
        return "tactus.World(" + std::to_string(w.scene().bodies.size()) + " bodies on " +
               w.devices().name() + ")";
      });
}

}  // namespace tactus::python

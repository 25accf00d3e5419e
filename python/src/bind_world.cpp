// The world: soft bodies, liquid and obstacles, stepped frame by frame.
#include <pybind11/stl.h>

#include <cmath>
#include <string_view>

#include "arrays.h"
#include "device_array.h"
#include "module.h"
#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"
#include "tactus/world/world.h"

namespace tactus::python {
namespace {

/// By QualityReduction.
constexpr const char* kReductions[] = {"photographs", "hull", "liquid", "samples"};
static_assert(std::size(kReductions) == kQualityReductions);
const char* word_of(QualityReduction reduction) { return kReductions[static_cast<std::size_t>(reduction)]; }

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
  world_ = std::make_shared<World>(*devices_, scene_.scene, assets_,
                                   perception_ != nullptr ? perception_->made.get() : nullptr);
  if (perception_ != nullptr) perception_->has_world = true;
}

void PyWorld::set_surface(const Observation& seen) {
  const Held world = get();
  world->set_surface(seen);
  if (seen.is_new) lost_images_ = false;
}

StepReport PyWorld::step(double dt_s, std::optional<std::int64_t> stream) {
  const Held world = get();
  begin_step(dt_s, stream);
  for (;;)
    if (std::optional<StepReport> report = continue_step()) return *std::move(report);
}

void PyWorld::begin_step(double dt_s, std::optional<std::int64_t> stream) {
  if (!(dt_s >= 0 && std::isfinite(dt_s)))
    throw usage_error("dt_s is " + number_text(dt_s) +
                      ", expected the time since the last frame [s], 0 or more");
  if (lost_images_)
    throw usage_error(
        "step: a loop failed with this World's last images, expected set_surface() with new "
        "ones before");
  devices_->wait_for(stream);
  world_->begin_step(dt_s);
}

std::optional<StepReport> PyWorld::continue_step() {
  std::optional<StepReport> report = world_->continue_step();
  if (report && perception_ != nullptr) perception_->frame.reset();
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
    world_ = std::make_shared<World>(*devices_, scene_.scene, assets_);
  }
  world_->load_state(bytes.substr(head.size()));
}

namespace {

constexpr auto kNoGil = py::call_guard<py::gil_scoped_release>();

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

/// A world that an array keeps: this one, though load_state() replaces it, with all that it stands on.
struct KeptWorld {
  std::shared_ptr<PyWorld> stands_on;
  std::shared_ptr<World> world;
};

template <View<const Vec3f> DeviceNodes::*kPart>
PyDeviceArray device_nodes_of(const std::shared_ptr<PyWorld>& world, const std::string& body) {
  const char* const what = kPart == &DeviceNodes::positions_m ? "positions" : "velocities";
  return make_device_array(world->shared_devices(), "'" + body + "': " + what, [world, body]() -> ShownRows {
    const PyWorld::Held held = world->get();
    const View<const Vec3f> of = device_nodes(*held, body).*kPart;
    return {of.data(), of.size(), true, std::make_shared<KeptWorld>(world, world->shared())};
  });
}

PyDeviceMesh device_surface_of(const std::shared_ptr<PyWorld>& world, const std::string& body) {
  return make_device_mesh(world->shared_devices(), "'" + body + "'", [world, body]() -> ShownMesh {
    const PyWorld::Held held = world->get();
    return {device_surface(*held, body), std::make_shared<KeptWorld>(world, world->shared())};
  });
}

Grab make_grab(const std::string& body, py::handle point_m, py::handle target_m,
               std::optional<double> radius_m, std::optional<double> stiffness_N_m,
               std::optional<double> max_force_N) {
  return {body,       vec3_of("point_m", point_m), vec3_of("target_m", target_m), radius_m, stiffness_N_m,
          max_force_N};
}

void set_grab(PyWorld& world, const std::optional<Grab>& grab) { world.get()->set_grab(grab); }

py::dict motion_forces_of(PyWorld& world) {
  std::vector<std::vector<MotionForce>> all;
  {
    const py::gil_scoped_release free;
    all = world.get()->motion_forces();
  }
  py::dict by_body;
  for (std::size_t b = 0; b < all.size(); ++b) {
    py::list regions;
    for (const MotionForce& f : all[b])
      regions.append(py::make_tuple(array_of(f.force_N), array_of(f.torque_N_m)));
    by_body[py::str(world.scene().bodies[b].name)] = regions;
  }
  return by_body;
}

py::dict timings_of(PyWorld& world) {
  const PyWorld::Held held = world.get();
  py::dict by_stage;
  for (const std::string& stage : held->timings().stages())
    by_stage[py::str(stage)] = held->timings().last_ms(stage);
  return by_stage;
}

void reduce_quality(PyWorld& world, const std::vector<std::string>& reductions) {
  std::vector<QualityReduction> chosen;
  for (const std::string& word : reductions) {
    const auto* const known = std::find(std::begin(kReductions), std::end(kReductions), word);
    if (known == std::end(kReductions))
      throw usage_error("reductions has '" + word +
                        "', expected 'photographs', 'hull', 'liquid' or 'samples'");
    chosen.push_back(static_cast<QualityReduction>(known - std::begin(kReductions)));
  }
  world.get()->reduce_quality(chosen);
}

void bind_grab(py::module_& m) {
  py::class_<Grab>(m, "Grab",
                   "A spring from a point of a body's surface to a target, shared among nodes near it.")
      .def(py::init(&make_grab), py::arg("body"), py::arg("point_m"), py::arg("target_m"),
           py::arg("radius_m") = py::none(), py::arg("stiffness_N_m") = py::none(),
           py::arg("max_force_N") = py::none(),
           "point_m: (3,) of the surface when the body is grabbed, world. target_m: (3,), which pulls by "
           "stiffness times its way beyond point_m. radius_m: of the tissue that is held, at rest; None: two "
           "spacings. stiffness_N_m: None: 8 E radius. max_force_N: None: E pi radius^2 / 2.")
      .def_readonly("body", &Grab::body)
      .def_property_readonly("point_m", [](const Grab& g) { return array_of(g.point_m); })
      .def_property_readonly("target_m", [](const Grab& g) { return array_of(g.target_m); })
      .def_readonly("radius_m", &Grab::radius_m)
      .def_readonly("stiffness_N_m", &Grab::stiffness_N_m)
      .def_readonly("max_force_N", &Grab::max_force_N)
      .def("__repr__", [](const Grab& g) { return "tactus.Grab('" + g.body + "')"; });
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
  bind_parameters(m);
  bind_grab(m);
  py::class_<PyWorld, std::shared_ptr<PyWorld>>(m, "World", "Soft bodies, liquid and obstacles of a scene.")
      .def(py::init(&make_world), py::arg("devices"), py::arg("scene"), py::arg("perception") = nullptr,
           "devices: 'cpu', 'cuda:0', .. or a Devices. perception: where cameras see something; its Devices.")
      .def("step", &PyWorld::step, py::arg("dt_s"), py::arg("stream") = py::none(), kNoGil,
           "One frame of dt_s [s] since the last one. Other Python threads run meanwhile. stream: a CUDA "
           "stream that still reads a DeviceArray; the frame begins after all that it has to do now.")
      .def("set_surface", &PyWorld::set_surface, py::arg("observation"),
           "The next step has the surface of these images.")
      .def(
          "set_pose",
          [](PyWorld& w, const std::string& tool, py::handle T, bool at_once) {
            w.get()->set_pose(tool, rigid_of("T_world_tool", T), at_once);
          },
          py::arg("tool"), py::arg("T_world_tool"), py::arg("at_once") = false,
          "Where an obstacle or a blade with 'held: true' is at the end of the next frame: (4, 4), [m]. It "
          "goes "
          "there evenly, and a blade cuts on the way. at_once: it is put down there, not led.")
      .def(
          "pose", [](PyWorld& w, const std::string& tool) { return array_of(w.get()->pose(tool)); },
          py::arg("tool"), "(4, 4): where a held blade, or an obstacle that moves, is now.")
      .def(
          "set_grab", &set_grab, py::arg("grab"),
          "From the next frame on this Grab's spring pulls; None: none does. The same body, point and radius "
          "as before are the same grab, whose target and strength change. StepReport.grab_N is its force.")
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
      .def("device_positions", &device_nodes_of<&DeviceNodes::positions_m>, py::arg("body"),
           "The same where they were computed: a DeviceArray.")
      .def("device_velocities", &device_nodes_of<&DeviceNodes::velocities_m_s>, py::arg("body"), "Likewise.")
      .def("device_surface", &device_surface_of, py::arg("body"),
           "The surface of a body that snapshot() copies, where it was computed: a DeviceMesh.")
      .def(
          "motion_forces", &motion_forces_of,
          "By body: (force_N (3,), torque_N_m (3,)) of each of its 'moved' regions on it, mean over the last "
          "frame; the torque about the region's pivot.")
      .def(
          "stroke_results", [](PyWorld& w) { return w.get()->stroke_results(); }, kNoGil,
          "Strokes of the blades so far.")
      .def("timings_ms", &timings_of, "By stage: milliseconds in the last frame that had it.")
      .def(
          "quality_reductions",
          [](PyWorld& w) {
            py::list names;
            for (const QualityReduction q : w.get()->quality_reductions()) names.append(word_of(q));
            return names;
          },
          "That reduce_quality() can make, the one that is missed least first.")
      .def("reduce_quality", &reduce_quality, py::arg("reductions"),
           "From the next new images on, frames make these reductions and no others. For a Perception with "
           "can_reduce.")
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

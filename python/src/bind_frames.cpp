// Cameras, images, hulls, and the loop over frames.
#include <pybind11/stl.h>

#include <cmath>

#include "arrays.h"
#include "device_array.h"
#include "module.h"
#include "tactus/base/error.h"
#include "tactus/geom/camera/place_limits.h"
#include "tactus/io/scene_file.h"
#include "tactus/reconstruct/surface_pipeline.h"
#include "tactus/run/scene_source.h"

namespace tactus::python {
namespace {

/// A hull, and what it was made on.
struct PyHull {
  SharedDevices devices;
  Rig rig;
  std::unique_ptr<SurfacePipeline> pipeline;
};

}  // namespace
}  // namespace tactus::python

TACTUS_BOUND(tactus::python::PyHull);

namespace tactus::python {
namespace {

Camera camera_of(const std::string& name, py::handle K, std::pair<Index, Index> size_px,
                 py::handle T_cam_world) {
  const auto k = doubles_of(K);
  if (!k || k.ndim() != 2 || k.shape(0) != 3 || k.shape(1) != 3) {
    throw usage_error("K of camera '" + name + "' is " + kind_of(K) + ", expected a (3, 3) array [px]");
  }
  if (name.empty()) throw usage_error("name is '', expected a name for the camera");
  const bool is_matrix = k.at(1, 0) == 0 && k.at(2, 0) == 0 && k.at(2, 1) == 0 && k.at(2, 2) == 1;
  bool is_finite = true;
  for (py::ssize_t i = 0; i < 9; ++i) is_finite = is_finite && std::abs(k.data()[i]) <= kMostFocal_px;
  if (!is_matrix || !is_finite || !(k.at(0, 0) > 0) || !(k.at(1, 1) > 0))
    throw usage_error(
        "K of camera '" + name +
        "' is no camera matrix: expected ((fx, s, cx), (0, fy, cy), (0, 0, 1)) [px], fx and fy > 0");
  constexpr Index kMostSize_px = 65536;
  if (size_px.first < 1 || size_px.second < 1 || size_px.first > kMostSize_px ||
      size_px.second > kMostSize_px)
    throw usage_error("size_px of camera '" + name + "' is (" + std::to_string(size_px.first) + ", " +
                      std::to_string(size_px.second) + "), expected (width, height), each 1 to 65536");
  const Camera camera{.name = name,
                      .width_px = size_px.first,
                      .height_px = size_px.second,
                      .fx_px = k.at(0, 0),
                      .fy_px = k.at(1, 1),
                      .cx_px = k.at(0, 2),
                      .cy_px = k.at(1, 2),
                      .skew_px = k.at(0, 1),
                      .T_cam_world = rigid_of("T_cam_world", T_cam_world)};
  check_camera(camera);
  return camera;
}

Box3f box_of(const std::string& argument, py::handle value) {
  const auto box = doubles_of(value);
  if (!box || box.ndim() != 2 || box.shape(0) != 2 || box.shape(1) != 3) {
    throw usage_error(argument + " is " + kind_of(value) +
                      ", expected ((x, y, z), (x, y, z)): its least and greatest corner [m]");
  }
  Box3f box_m;
  for (int a = 0; a < 3; ++a) {
    box_m.min[a] = static_cast<float>(box.at(0, a));
    box_m.max[a] = static_cast<float>(box.at(1, a));
  }
  const Vec3f edge = box_m.extent();
  if (!(edge.x > 0 && edge.y > 0 && edge.z > 0 && std::isfinite(edge.x + edge.y + edge.z)))
    throw usage_error(argument + " has edges of " + number_text(double{edge.x}) + ", " +
                      number_text(double{edge.y}) + " and " + number_text(double{edge.z}) +
                      " m, expected its least corner before its greatest");
  if (!is_workspace(box_m)) throw usage_error(argument + ": " + kWorkspaceRange);
  return box_m;
}

template <class F>
auto images_of(const char* argument, py::handle list, F&& one) {
  std::vector<decltype(one(std::string(), py::handle()))> images;
  if (list.is_none()) return images;
  if (!py::isinstance<py::sequence>(list) || py::isinstance<py::str>(list) || py::isinstance<py::bytes>(list))
    throw usage_error(std::string(argument) + " is " + kind_of(list) +
                      ", expected a list with an array for each camera");
  int k = 0;
  for (const py::handle image : list)
    images.push_back(one(std::string(argument) + "[" + std::to_string(k++) + "]", image));
  return images;
}

std::shared_ptr<FrameSet> frame_of(py::handle masks, std::int64_t tick, double time_s, py::handle depths_m,
                                   py::handle colors) {
  if (!std::isfinite(time_s)) throw usage_error("time_s is " + number_text(time_s) + ", expected a time [s]");
  auto frame = std::make_shared<FrameSet>();
  frame->tick = tick;
  frame->time_s = time_s;
  frame->silhouettes = images_of("masks", masks, mask_of);
  frame->depths_m = images_of("depths_m", depths_m, depth_of);
  frame->colors = images_of("colors", colors, color_of);
  return frame;
}

/// @throws IndexError.
template <class T>
const T& image_at(const std::vector<T>& images, py::ssize_t camera) {
  if (camera < 0 || camera >= static_cast<py::ssize_t>(images.size()))
    throw py::index_error("camera " + std::to_string(camera) + " of " + std::to_string(images.size()));
  return images[static_cast<std::size_t>(camera)];
}

void bind_images(py::module_& m) {
  py::class_<Camera>(m, "Camera", "A camera without distortion, as OpenCV's: x right, y down, z ahead.")
      .def(py::init(&camera_of), py::arg("name"), py::arg("K"), py::arg("size_px"), py::arg("T_cam_world"),
           "K: (3, 3) [px]. size_px: (width, height). T_cam_world: (4, 4), world to camera [m].")
      .def_readonly("name", &Camera::name)
      .def_property_readonly("K", [](const Camera& c) { return array_of(c.intrinsics()); })
      .def_property_readonly("T_cam_world", [](const Camera& c) { return array_of(c.T_cam_world); })
      .def_property_readonly("size_px", [](const Camera& c) { return std::pair(c.width_px, c.height_px); })
      .def("__repr__", [](const Camera& c) {
        return "tactus.Camera('" + c.name + "', " + std::to_string(c.width_px) + " x " +
               std::to_string(c.height_px) + ")";
      });
  py::class_<Rig>(m, "Rig", "Cameras and the space that they watch.")
      .def(py::init([](const std::string& path) { return read_rig(path); }), py::arg("path"),
           "From a rig file (docs/rig.md).")
      .def(py::init([](const std::vector<Camera>& cameras, py::handle workspace_m) {
             Rig rig;
             rig.cameras = cameras;
             for (std::size_t k = 0; k < cameras.size(); ++k)
               for (std::size_t j = 0; j < k; ++j)
                 if (cameras[j].name == cameras[k].name)
                   throw usage_error("cameras has '" + cameras[k].name + "' twice, expected a name for each");
             rig.workspace_m = box_of("workspace_m", workspace_m);
             return rig;
           }),
           py::arg("cameras"), py::arg("workspace_m"), "workspace_m: ((x, y, z), (x, y, z)) [m]")
      .def_readonly("cameras", &Rig::cameras)
      .def("__repr__",
           [](const Rig& r) { return "tactus.Rig(" + std::to_string(r.cameras.size()) + " cameras)"; });
  py::class_<FrameSet, std::shared_ptr<FrameSet>>(m, "Frame", "The images of a rig at one moment.")
      .def(py::init(&frame_of), py::arg("masks"), py::arg("tick") = 0, py::arg("time_s") = 0.0,
           py::arg("depths_m") = py::none(), py::arg("colors") = py::none(),
           "masks: one (height, width) array of bool or uint8 per camera, inside where not 0; None: it "
           "missed the "
           "tick. depths_m: likewise, float32, radial [m]. colors: (height, width, 3) uint8.")
      .def_readonly("tick", &FrameSet::tick)
      .def_readonly("time_s", &FrameSet::time_s)
      .def(
          "mask",
          [](const FrameSet& f, py::ssize_t camera) {
            const BitMask& mask = image_at(f.silhouettes, camera);
            py::array_t<bool> array({mask.height_px, mask.width_px});
            for (Index y = 0; y < mask.height_px; ++y)
              for (Index x = 0; x < mask.width_px; ++x) array.mutable_at(y, x) = mask(x, y);
            return array;
          },
          py::arg("camera"), "(height, width) bool")
      .def_property_readonly("depth_count", [](const FrameSet& f) { return f.depths_m.size(); })
      .def(
          "depth_m",
          [](py::object self, py::ssize_t camera) {
            const DepthImage& depth = image_at(self.cast<const FrameSet&>().depths_m, camera);
            return view_of(depth.pixels.data(), {depth.height_px, depth.width_px}, self);
          },
          py::arg("camera"), "(height, width) float32, radial [m], of a depth camera; a view");
}

PyDeviceMesh device_mesh_of(const std::shared_ptr<PyHull>& hull) {
  return make_device_mesh(hull->devices, "hull", [hull]() -> ShownMesh {
    const auto lock = hold(hull->devices->calls, "VisualHull");
    return {device_mesh(hull->pipeline->finished()), hull};
  });
}

PyDeviceMesh device_surface_of(const std::shared_ptr<PyPerception>& seen) {
  return make_device_mesh(seen->devices, "surface", [seen]() -> ShownMesh {
    const auto lock = hold(seen->devices->calls, "Perception");
    return {device_surface(*seen->made), seen};
  });
}

py::tuple corners_of(const Box3f& box_m) {
  return py::make_tuple(array_of(vec_cast<double>(box_m.min)), array_of(vec_cast<double>(box_m.max)));
}

void bind_hull(py::module_& m) {
  py::class_<PyHull, std::shared_ptr<PyHull>>(m, "VisualHull", "The surface that silhouettes allow.")
      .def(py::init([](py::handle devices, const Rig& rig, int resolution) {
             auto hull = std::make_shared<PyHull>();
             hull->devices = devices_of(devices);
             hull->rig = rig;
             const py::gil_scoped_release free;
             const auto lock = hold(hull->devices->calls, "VisualHull");
             hull->pipeline =
                 std::make_unique<SurfacePipeline>(*hull->devices, rig.cameras, rig.depth_cameras,
                                                   SurfaceOptions{.hull = {.workspace_m = rig.workspace_m,
                                                                           .resolution = resolution,
                                                                           .slack_px = rig.slack_px}});
             return hull;
           }),
           py::arg("devices"), py::arg("rig"), py::arg("resolution") = 100)
      .def(
          "reconstruct",
          [](PyHull& hull, const FrameSet& frame, std::optional<std::int64_t> stream) {
            const auto lock = hold(hull.devices->calls, "VisualHull");
            hull.devices->wait_for(stream);
            hull.pipeline->make(frame.silhouettes, frame.depths_m);
            return std::make_shared<TriangleMesh>(hull.pipeline->download());
          },
          py::arg("frame"), py::arg("stream") = py::none(), py::call_guard<py::gil_scoped_release>(),
          "The mesh of a Frame, with normals. stream: as World.step's.")
      .def("device_mesh", &device_mesh_of, "The last mesh where it was computed: a DeviceMesh.")
      .def_property_readonly("voxel_size_m",
                             [](const PyHull& hull) { return hull.pipeline->voxel_size_m(); });
}

}  // namespace

std::shared_ptr<PyPerception> perception_of(const SharedDevices& devices, const PyScene& scene,
                                            const Rig& rig, bool can_reduce) {
  auto seen = std::make_shared<PyPerception>();
  seen->devices = devices;
  seen->scene = scene.scene;
  seen->rig = rig;
  seen->assets = load_body_assets(scene.scene);
  seen->made = make_perception(*devices, seen->scene, seen->rig, seen->assets, can_reduce);
  return seen->made == nullptr ? nullptr : seen;
}

void bind_frames(py::module_& m) {
  bind_images(m);
  bind_hull(m);
  py::class_<Observation>(m, "Observation", "What a Perception saw in new images.")
      .def_readonly("is_new", &Observation::is_new)
      .def_readonly("notices", &Observation::notices);
  py::class_<PyPerception, std::shared_ptr<PyPerception>>(
      m, "Perception", "From images to the surface that touches bodies; for one World.")
      .def(py::init([](py::handle devices, const PyScene& scene, const Rig& rig, bool can_reduce) {
             const SharedDevices on = devices_of(devices);
             const py::gil_scoped_release free;
             const auto lock = hold(on->calls, "Perception");
             auto seen = perception_of(on, scene, rig, can_reduce);
             if (seen == nullptr)
               throw usage_error("rig has no cameras: a World without them needs no Perception");
             return seen;
           }),
           py::arg("devices"), py::arg("scene"), py::arg("rig"), py::arg("can_reduce") = false,
           "can_reduce: prepares for World.reduce_quality, which takes memory.")
      .def(
          "observe",
          [](PyPerception& p, const std::shared_ptr<FrameSet>& frame, double dt_s) {
            const auto lock = hold(p.devices->calls, "Perception");
            p.frame = frame;  // it is read until the next step ended
            return p.made->observe(frame.get(), dt_s);
          },
          py::arg("frame"), py::arg("dt_s"), py::call_guard<py::gil_scoped_release>(),
          "frame: new images, or None. For World.set_surface, before its step of dt_s.")
      .def_property_readonly("devices", [](const PyPerception& p) { return p.devices; })
      .def(
          "surface",
          [](PyPerception& p) {
            const auto lock = hold(p.devices->calls, "Perception");
            return std::make_shared<TriangleMesh>(p.made->download());
          },
          py::call_guard<py::gil_scoped_release>(), "The surface of the last frame.")
      .def("device_surface", &device_surface_of, "The same where it was computed: a DeviceMesh.")
      .def(
          "last_notices",
          [](PyPerception& p) {
            const auto lock = hold(p.devices->calls, "Perception");
            return p.made->last_notices();
          },
          py::call_guard<py::gil_scoped_release>(),
          "After the last frame: Notices that came later than their frames, as those of the check of masks.")
      .def_property_readonly("voxel_size_m", [](const PyPerception& p) { return p.made->voxel_size_m(); })
      .def_property_readonly(
          "workspace_m", [](const PyPerception& p) { return corners_of(p.made->workspace_m()); },
          "((3,), (3,)): least and greatest corner");
}

}  // namespace tactus::python

// Cameras from pictures of a board.
#include <pybind11/stl.h>

#include <algorithm>
#include <filesystem>

#include "arrays.h"
#include "module.h"
#include "tactus/base/error.h"
#include "tactus/rig/calibrate/calibrate_cameras.h"
#include "tactus/rig/calibrate/coverage.h"

namespace tactus::python {
namespace {

struct PyCalibration {
  CalibrationReport report;
  std::vector<CalibratedCamera> cameras;  ///< in the world that is written
  std::vector<std::string> advice;        ///< by camera

  /// Of a camera, by its index or from the end. @throws IndexError.
  const CalibratedCamera& camera(py::ssize_t k) const {
    const auto count = static_cast<py::ssize_t>(cameras.size());
    if (k < -count || k >= count)
      throw py::index_error("camera " + std::to_string(k) + " of " + std::to_string(count));
    return cameras[static_cast<std::size_t>(k < 0 ? k + count : k)];
  }
};

}  // namespace
}  // namespace tactus::python

TACTUS_BOUND(tactus::python::PyCalibration);

namespace tactus::python {
namespace {

using Grey = Image<std::uint8_t>;

/// Pictures of a camera: where they are, or arrays.
struct CameraPictures {
  std::string name, pattern;
  std::vector<Grey> arrays;  ///< empty: of an instant that it missed
};

/// (height, width) or (height, width, 3) of uint8; its luma, by BT.601.
Grey grey_of(const std::string& argument, py::handle value) {
  if (value.is_none()) return {};
  const std::string expected = "a (height, width) or (height, width, 3) array of uint8, or None";
  const bool is_color =
      py::isinstance<py::array>(value) && py::reinterpret_borrow<py::array>(value).ndim() == 3;
  if (is_color) {
    const ColorImage color = color_of(argument, value);
    Grey grey(color.width_px, color.height_px);
    std::transform(color.pixels.begin(), color.pixels.end(), grey.pixels.begin(), [](const auto& p) {
      return static_cast<std::uint8_t>((299 * p.r + 587 * p.g + 114 * p.b + 500) / 1000);
    });
    return grey;
  }
  const bool is_grey = py::isinstance<py::array>(value) &&
                       py::reinterpret_borrow<py::array>(value).ndim() == 2 &&
                       py::reinterpret_borrow<py::array>(value).dtype().equal(py::dtype::of<std::uint8_t>());
  if (!is_grey) throw usage_error(argument + " is " + kind_of(value) + ", expected " + expected);
  const auto array = py::array_t<std::uint8_t, py::array::c_style>::ensure(value);
  Grey grey(static_cast<Index>(array.shape(1)), static_cast<Index>(array.shape(0)));
  std::copy_n(array.data(), array.size(), grey.pixels.begin());
  return grey;
}

std::vector<CameraPictures> pictures_of(const py::dict& pictures) {
  if (pictures.empty())
    throw usage_error("pictures is empty, expected a dict of cameras' names and their pictures");
  std::vector<CameraPictures> all;
  for (const auto& [name, value] : pictures) {
    if (!py::isinstance<py::str>(name))
      throw usage_error("pictures has " + kind_of(name) + " for a key, expected a camera's name");
    CameraPictures camera{name.cast<std::string>(), "", {}};
    const std::string argument = "pictures['" + camera.name + "']";
    if (py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__")) {
      camera.pattern = py::str(value).cast<std::string>();
    } else if (py::isinstance<py::sequence>(value) && !py::isinstance<py::bytes>(value)) {
      int k = 0;
      for (const py::handle picture : py::reinterpret_borrow<py::sequence>(value))
        camera.arrays.push_back(grey_of(argument + "[" + std::to_string(k++) + "]", picture));
    } else {
      throw usage_error(argument + " is " + kind_of(value) +
                        ", expected a film, a pattern of files with one %d, or a list of arrays");
    }
    all.push_back(std::move(camera));
  }
  return all;
}

/// In arrays, as find_boards does in files.
BoardPictures boards_in(const Board& board, const std::vector<CameraPictures>& cameras) {
  BoardPictures found;
  found.size_px.resize(cameras.size());
  found.picture_count.resize(cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    const std::vector<Grey>& arrays = cameras[c].arrays;
    found.instants = std::max(found.instants, static_cast<Index>(arrays.size()));
    for (std::size_t k = 0; k < arrays.size(); ++k) {
      if (arrays[k].pixels.empty()) continue;
      const Vec2i size{arrays[k].width_px, arrays[k].height_px};
      if (found.picture_count[c] > 0 && size != found.size_px[c])
        throw usage_error("pictures['" + cameras[c].name + "'][" + std::to_string(k) + "] has " +
                          std::to_string(size.x) + "x" + std::to_string(size.y) + " pixels, expected " +
                          std::to_string(found.size_px[c].x) + "x" + std::to_string(found.size_px[c].y) +
                          " as the first");
      found.size_px[c] = size;
      ++found.picture_count[c];
      BoardView view{static_cast<Index>(c), static_cast<Index>(k), detect_board(board, arrays[k])};
      if (!view.corners.empty()) found.views.push_back(std::move(view));
    }
    if (found.picture_count[c] == 0)
      throw usage_error("pictures['" + cameras[c].name + "'] has no picture, expected one or more");
  }
  return found;
}

BoardPictures look_for(const Board& board, const std::vector<CameraPictures>& cameras, int every) {
  const auto is_file = [](const CameraPictures& c) { return !c.pattern.empty(); };
  if (std::none_of(cameras.begin(), cameras.end(), is_file)) return boards_in(board, cameras);
  if (!std::all_of(cameras.begin(), cameras.end(), is_file))
    throw usage_error("pictures has files and arrays, expected one or the other for all cameras");
  std::vector<std::string> patterns;
  for (const CameraPictures& c : cameras) patterns.push_back(c.pattern);
  return find_boards(board, patterns, {.step = every});
}

struct CalibrateArguments {
  std::string board;
  double square_m = 0, marker_m = 0;
  bool inverted = false;
  std::string lens;
  int coefficients = 5, every = 1;
  std::optional<int> floor;
  bool refine_lenses = false;
};

PyCalibration calibration_of(const std::vector<CameraPictures>& cameras, const CalibrateArguments& of,
                             const PyCalibration* lenses) {
  const Board board = parse_board(of.board, of.square_m, of.marker_m, of.inverted);
  CalibrateCamerasOptions how{.bundle = lens_options(of.lens, of.coefficients),
                              .lenses = {},
                              .refine_lenses = of.refine_lenses,
                              .floor = of.floor};
  if (of.every < 1)
    throw usage_error("every is " + std::to_string(of.every) + ", expected every so many frames, 1 or more");
  if (!calibration_missing().empty()) throw Error(calibration_missing());
  std::vector<std::string> names;
  for (const CameraPictures& c : cameras) {
    names.push_back(c.name);
    if (lenses == nullptr) continue;
    const std::vector<CalibratedCamera>& known = lenses->cameras;
    const auto own = std::find_if(known.begin(), known.end(),
                                  [&](const CalibratedCamera& k) { return k.camera.name == c.name; });
    if (own == known.end())
      throw usage_error("lenses has no camera '" + c.name + "', expected one for each of pictures");
    how.lenses.push_back(*own);
    how.lenses.back().camera.T_cam_world = {};
  }
  const BoardPictures seen = look_for(board, cameras, of.every);
  PyCalibration result{calibrate_cameras(board, seen, names, how), {}, {}};
  result.cameras = cameras_in_world(result.report);
  for (std::size_t c = 0; c < names.size(); ++c)
    result.advice.push_back(coverage_of(seen.views, static_cast<Index>(c), seen.size_px[c]).advice);
  return result;
}

PyCalibration calibrate(const py::dict& pictures, const std::string& board, double square_m, double marker_m,
                        bool inverted, const std::string& lens, int coefficients, int every,
                        const PyCalibration* lenses, bool refine_lenses, std::optional<int> floor) {
  const std::vector<CameraPictures> cameras = pictures_of(pictures);
  if (floor && *floor < 0)
    throw usage_error("floor is " + std::to_string(*floor) + ", expected the number of a picture, or None");
  const py::gil_scoped_release free;
  return calibration_of(
      cameras, {board, square_m, marker_m, inverted, lens, coefficients, every, floor, refine_lenses},
      lenses);
}

py::dict lens_of(const PyCalibration& all, py::ssize_t camera) {
  const CalibratedCamera& c = all.camera(camera);
  py::dict lens;
  lens["model"] = lens_name(c.lens.model);
  const std::vector<double> all_of_it = coefficients(c.lens);
  lens["coefficients"] = py::array_t<double>(static_cast<py::ssize_t>(all_of_it.size()), all_of_it.data());
  return lens;
}

/// Several cameras: as `tactus calibrate rig`; one: as `tactus calibrate intrinsics`.
void write(const PyCalibration& all, const std::string& folder) {
  std::filesystem::create_directories(folder);
  if (all.cameras.size() > 1) return write_rig_calibration(all.report, folder, folder + "/report.html");
  write_lens_calibration(all.report, folder + "/" + all.cameras[0].camera.name + ".yaml");
  write_calibration_page(all.report, folder + "/report.html");
}

py::list board_poses(const PyCalibration& all) {
  py::list poses;
  for (const std::optional<Rigidd>& T : all.report.result.T_world_board)
    poses.append(T ? py::object(array_of(all.report.T_world_first * *T)) : py::none());
  return poses;
}

py::list left_out(const PyCalibration& all) {
  py::list views;
  for (const ViewResidual& v : all.report.result.views)
    if (v.left_out) views.append(py::make_tuple(all.camera(v.camera).camera.name, v.instant, v.rms_px));
  return views;
}

}  // namespace

void bind_calibrate(py::module_& m) {
  constexpr auto kNoGil = py::call_guard<py::gil_scoped_release>();
  py::class_<PyCalibration>(m, "Calibration", "Cameras, found from pictures of a board.")
      .def_property_readonly(
          "cameras",
          [](const PyCalibration& all) {
            std::vector<Camera> cameras;
            for (const CalibratedCamera& c : all.cameras) cameras.push_back(c.camera);
            return cameras;
          },
          "Cameras in the order of the pictures; without their lenses")
      .def("lens", &lens_of, py::arg("camera"),
           "model: 'brown', 'fisheye', ..; coefficients: in OpenCV's order.")
      .def_property_readonly(
          "rms_px", [](const PyCalibration& all) { return all.report.result.rms_px; },
          "root of the mean square distance of corners from where they should be")
      .def_property_readonly(
          "camera_rms_px", [](const PyCalibration& all) { return all.report.result.camera_rms_px; },
          "the same, by camera")
      .def_property_readonly("board_poses", &board_poses,
                             "T_world_board (4, 4) by instant; None where the board was not placed")
      .def_property_readonly("left_out", &left_out, "(camera, instant, rms_px) of pictures that disagree")
      .def_property_readonly(
          "advice", [](const PyCalibration& all) { return all.advice; },
          "by camera: where in its image the board was not seen; '' when it was everywhere")
      .def("write", &write, py::arg("folder"), kNoGil,
           "Several cameras: rig.yaml, cameras.json, report.html. One: NAME.yaml (OpenCV), report.html.")
      .def("__repr__", [](const PyCalibration& all) {
        return "tactus.Calibration(" + std::to_string(all.cameras.size()) + " cameras, RMS " +
               number_text(all.report.result.rms_px) + " px)";
      });
  m.def(
      "calibrate", &calibrate, py::arg("pictures"), py::arg("board"), py::kw_only(), py::arg("square_m"),
      py::arg("marker_m") = 0.0, py::arg("inverted") = false, py::arg("lens") = "brown",
      py::arg("coefficients") = 5, py::arg("every") = 1,
      py::arg("lenses") = static_cast<const PyCalibration*>(nullptr), py::arg("refine_lenses") = false,
      py::arg("floor") = std::nullopt,
      "Cameras from pictures of a board: a Calibration. One camera: its lens. Several: their poses, too, "
      "from "
      "pictures of the same number, which are taken at the same instant.\n\n"
      "pictures: by camera's name a film, a pattern of files with one %d, or arrays (height, width) or "
      "(height, width, 3) of uint8, None where there is none. board: 'chessboard:9x6' (inner corners) or "
      "'charuco:4x5:4X4_50' (squares, dictionary). square_m, marker_m: sides [m]. inverted: white on black. "
      "lens: 'brown' or 'fisheye'. coefficients: of a brown one: 2, 4, 5 or 8. every: so many frames of "
      "films. lenses: a Calibration whose lenses these cameras have; refine_lenses: improve them. floor: "
      "the picture in which the board lies on the floor, with +Y up.\n"
      "Raises Error naming the camera that sees too little, shares no picture with the others, or has a "
      "file that can't be read.");
}

}  // namespace tactus::python

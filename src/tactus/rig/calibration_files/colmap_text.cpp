/// COLMAP's cameras.txt and images.txt.
#include <sstream>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/rig/calibration_files/colmap.h"

namespace tactus::calibration {
namespace {

bool recognise_colmap_text(const Input& input) { return !colmap_folder(input, ".txt").empty(); }

/// Calls body(line, "FILE:LINE") for every line that is no comment.
template <class F>
void for_lines(const std::string& file, F&& body) {
  std::istringstream in(read_text(file, kMaxCalibrationBytes, ReadFrom::regular_file));
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (!line.starts_with('#')) body(line, file + ":" + std::to_string(number));
  }
}

std::map<std::uint32_t, CalibratedCamera> read_text_lenses(const std::string& file) {
  std::map<std::uint32_t, CalibratedCamera> lenses;
  for_lines(file, [&](const std::string& line, const std::string& where) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) return;
    std::istringstream in(line);
    std::uint32_t id = 0;
    std::string name;
    Vec2i size;
    if (!(in >> id >> name >> size.x >> size.y))
      throw Error(where + ": expected CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS");
    if (size.x < 1 || size.y < 1 || size.x > 32768 || size.y > 32768)
      throw Error(where + ": an image of " + std::to_string(size.x) + "x" + std::to_string(size.y) +
                  " pixels");
    const ColmapModel* model = colmap_model(name);
    if (model == nullptr) throw Error(where + ": the camera model " + excerpt(name) + " is not known");
    std::vector<double> p(model->parameters);
    for (double& v : p) {
      if (!(in >> v))
        throw Error(where + ": " + name + " has " + std::to_string(p.size()) +
                    " parameters, not all are there");
    }
    lenses[id] = colmap_camera(*model, size, p, where);
  });
  return lenses;
}

std::vector<ColmapImage> read_text_images(const std::string& file) {
  std::vector<ColmapImage> images;
  bool is_points = false;  // every second line lists points, and may be empty
  for_lines(file, [&](const std::string& line, const std::string& where) {
    if (is_points) {
      is_points = false;
      return;
    }
    if (line.find_first_not_of(" \t\r") == std::string::npos) return;
    std::istringstream in(line);
    ColmapImage image{};
    std::uint32_t id = 0;
    double* q = image.q_wxyz;
    if (!(in >> id >> q[0] >> q[1] >> q[2] >> q[3] >> image.t.x >> image.t.y >> image.t.z >>
          image.camera_id >> image.name))
      throw Error(where + ": expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME");
    images.push_back(std::move(image));
    is_points = true;
  });
  return images;
}

std::vector<FileCamera> read_colmap_text(const Input& input, const CalibrationAnswers& answers) {
  const std::string folder = colmap_folder(input, ".txt");
  return colmap_rig(read_text_lenses(folder + "/cameras.txt"), read_text_images(folder + "/images.txt"),
                    input.path, answers);
}

std::string numbers(std::span<const double> values) {
  std::string text;
  for (const double v : values) text += " " + exact(v);
  return text;
}

std::string parameters(const FileCamera& file) {
  const Camera& c = file.calibrated.camera;
  const std::vector<double> K{c.fx_px, c.fy_px, c.cx_px + 0.5, c.cy_px + 0.5};
  std::vector<double> d = coefficients(file.calibrated.lens);
  const bool fisheye = file.calibrated.lens.model == LensModel::fisheye;
  if (d.size() > 8) {
    throw usage_error("COLMAP files hold 8 coefficients of a brown lens, camera '" + c.name + "' has " +
                      std::to_string(d.size()) + "; write opencv or multical");
  }
  if (d.size() == 5) d.resize(8);
  const char* model =
      d.empty() ? "PINHOLE" : (fisheye ? "OPENCV_FISHEYE" : (d.size() == 4 ? "OPENCV" : "FULL_OPENCV"));
  return std::string(model) + " " + std::to_string(c.width_px) + " " + std::to_string(c.height_px) +
         numbers(K) + numbers(d);
}

void write_colmap_text(const std::string& path, std::span<const FileCamera> cameras) {
  refuse_skew("COLMAP", cameras);
  refuse_sphere_lens("COLMAP", cameras);
  std::string lenses = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n",
              images = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n# POINTS2D[]\n";
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Camera& c = cameras[i].calibrated.camera;
    const std::string id = std::to_string(i + 1);
    lenses += id + " " + parameters(cameras[i]) + "\n";
    const Quat<double> q = quaternion_of(c.T_cam_world.R);
    const Vec3d t = c.T_cam_world.t;
    images +=
        id + numbers(std::vector{q.w, q.x, q.y, q.z, t.x, t.y, t.z}) + " " + id + " " + c.name + ".png\n\n";
  }
  make_folder(path);
  write_text(path + "/cameras.txt", lenses);
  write_text(path + "/images.txt", images);
  write_text(path + "/points3D.txt", "");
}

}  // namespace

const Format kColmapText{"colmap",         "COLMAP cameras.txt and images.txt in a folder",
                         "unit",           recognise_colmap_text,
                         read_colmap_text, write_colmap_text};

}  // namespace tactus::calibration

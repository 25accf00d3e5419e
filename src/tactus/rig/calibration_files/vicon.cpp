/// Vicon's .xcp: per camera FOCAL_LENGTH and PRINCIPAL_POINT [px], ORIENTATION (world to camera, a quaternion
/// with its real part last), POSITION (the centre) [mm]. VICON_RADIAL2 "Vicon3Parameter cx cy k1 k2 k3" and
/// VICON_RADIAL "k1 k2" take a pixel of the photo to where a pinhole has it:
///   p' = c + (1 + k1 r^2 + k2 r^4 + k3 r^6) (p - c), r = |p - c| in pixels.
/// That is the inverse of our lens, so a brown lens is fitted to it.
#include <array>
#include <cmath>
#include <sstream>

#include "tactus/base/error.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

constexpr std::size_t kUnknowns = 5;  ///< k1 k2 p1 p2 k3
using Row = std::array<double, kUnknowns + 1>;

struct Radial {
  Vec2d center;
  double k1 = 0, k2 = 0, k3 = 0;
  Vec2d corrected(Vec2d p) const {
    const Vec2d d = p - center;
    const double r2 = d.x * d.x + d.y * d.y;
    return center + (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) * d;
  }
};

bool recognise_vicon(const Input& input) {
  const DataNode* cameras = input.xml ? input.xml->find("Cameras") : nullptr;
  return cameras != nullptr && cameras->has("Camera");
}

Radial radial_of(const DataNode& frame, Vec2d principal_point) {
  Radial r{principal_point};
  if (const DataNode* node = frame.find("VICON_RADIAL2"); node != nullptr && !node->text.empty()) {
    std::istringstream in(node->text);
    std::string name;
    if (!(in >> name >> r.center.x >> r.center.y >> r.k1 >> r.k2 >> r.k3) || name != "Vicon3Parameter")
      node->fail("'" + node->text.substr(0, 40) + "', expected Vicon3Parameter and five numbers");
  } else if (const DataNode* old = frame.find("VICON_RADIAL")) {
    const std::vector<double> k = old->numbers(2);
    r.k1 = k[0];
    r.k2 = k[1];
  }
  return r;
}

/// Solves the normal equations, whose last column is the right side, by elimination with row pivots.
std::vector<double> solve(std::array<Row, kUnknowns> m) {
  for (std::size_t c = 0; c < kUnknowns; ++c) {
    std::size_t best = c;
    for (std::size_t r = c + 1; r < kUnknowns; ++r)
      best = std::abs(m[r][c]) > std::abs(m[best][c]) ? r : best;
    std::swap(m[c], m[best]);
    for (std::size_t r = 0; r < kUnknowns; ++r) {
      const double factor = r == c ? 0 : m[r][c] / m[c][c];
      for (std::size_t k = c; k <= kUnknowns; ++k) m[r][k] -= factor * m[c][k];
    }
  }
  std::vector<double> x;
  for (std::size_t c = 0; c < kUnknowns; ++c) x.push_back(m[c][kUnknowns] / m[c][c]);
  return x;
}

/// The brown lens that has the photo's pixels where Vicon's has them, by least squares over a grid of them: a
/// brown lens is linear in its coefficients. @throws Error at `frame` when it errs by more than half a pixel.
Lens fitted(const Camera& camera, const Radial& radial, const DataNode& frame) {
  if (radial.k1 == 0 && radial.k2 == 0 && radial.k3 == 0) return {};
  constexpr int kSteps = 40;
  const auto ideal = [&](Vec2d px) {
    return Vec2d{(px.x - camera.cx_px) / camera.fx_px, (px.y - camera.cy_px) / camera.fy_px};
  };
  const auto for_grid = [&](auto&& use) {
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; j <= kSteps; ++j) {
        const Vec2d px{(camera.width_px - 1.0) * i / kSteps, (camera.height_px - 1.0) * j / kSteps};
        use(ideal(radial.corrected(px)), ideal(px));
      }
    }
  };
  std::array<Row, kUnknowns> normal{};
  for_grid([&](Vec2d p, Vec2d seen) {
    const double r2 = p.x * p.x + p.y * p.y, r4 = r2 * r2, xy = 2 * p.x * p.y;
    const Row rows[] = {{p.x * r2, p.x * r4, xy, r2 + 2 * p.x * p.x, p.x * r2 * r4, seen.x - p.x},
                        {p.y * r2, p.y * r4, r2 + 2 * p.y * p.y, xy, p.y * r2 * r4, seen.y - p.y}};
    for (const Row& row : rows) {
      for (std::size_t a = 0; a < kUnknowns; ++a) {
        for (std::size_t b = 0; b <= kUnknowns; ++b) normal[a][b] += row[a] * row[b];
      }
    }
  });
  const std::vector<double> k = solve(normal);
  double worst_px = 0;
  const Lens lens = std::isfinite(k[0] + k[1] + k[2] + k[3] + k[4]) ? make_lens(LensModel::brown, k) : Lens{};
  for_grid([&](Vec2d p, Vec2d seen) {
    const Vec2d off = lens.distort(p) - seen;
    worst_px = std::max(worst_px, std::hypot(camera.fx_px * off.x, camera.fy_px * off.y));
  });
  if (!(worst_px <= 0.5))
    frame.fail("its radial distortion is no lens: within the picture no brown lens comes nearer than " +
               number_text(worst_px) + " px, expected coefficients for distances in pixels");
  return lens;
}

FileCamera read_one(const DataNode& from, const DataNode& frame, const std::string& path,
                    const CalibrationAnswers& answers) {
  FileCamera c;
  Camera& camera = c.calibrated.camera;
  camera.name = from.at("DEVICEID").text;
  const std::vector<double> size = from.at("SENSOR_SIZE").numbers(2);
  set_size(camera, image_size(path, "Vicon", Vec2i{static_cast<Index>(size[0]), static_cast<Index>(size[1])},
                              answers));
  for (const auto& [key, expected] : {std::pair{"PIXEL_ASPECT_RATIO", 1.0}, std::pair{"SKEW", 0.0}}) {
    const DataNode* node = from.find(key);
    if (node != nullptr && std::abs(node->number() - expected) > 1e-4)
      node->fail("'" + node->text + "', expected " + number_text(expected) + ": square pixels without skew");
  }
  const double f = frame.at("FOCAL_LENGTH").number();
  const std::vector<double> pp = frame.at("PRINCIPAL_POINT").numbers(2);
  set_intrinsics(camera, {{{f, 0, pp[0]}, {0, f, pp[1]}, {0, 0, 1}}}, frame.at("FOCAL_LENGTH"));
  c.calibrated.lens = fitted(camera, radial_of(frame, {pp[0], pp[1]}), frame);
  const DataNode& turn = frame.at("ORIENTATION");
  const std::vector<double> q = turn.numbers(4);
  if (const double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]; !(std::abs(n - 1) < 1e-2))
    turn.fail("is no unit quaternion");
  const Mat3d R = rotation_from_quaternion(q[3], q[0], q[1], q[2]);
  camera.T_cam_world = {R, -(R * (1e-3 * read_vector(frame.at("POSITION"))))};
  return c;
}

std::vector<FileCamera> read_vicon(const Input& input, const CalibrationAnswers& answers) {
  known_unit_m(input.path, "Vicon", 1e-3, answers);
  std::vector<FileCamera> cameras;
  if (!input.xml) throw Error(input.path + ": no XML");
  for (const DataNode* from : input.xml->at("Cameras").all("Camera")) {
    // Cameras that were not calibrated have no key frame. A moving camera has several; the first counts.
    const DataNode* frames = from->find("KeyFrames");
    const DataNode* frame = frames != nullptr ? frames->find("KeyFrame") : nullptr;
    if (frame != nullptr) cameras.push_back(read_one(*from, *frame, input.path, answers));
  }
  return cameras;
}

}  // namespace

const Format kVicon{"vicon", "Vicon .xcp", "", recognise_vicon, read_vicon, nullptr};

}  // namespace tactus::calibration

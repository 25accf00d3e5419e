/// Projection matrices P = K [R|t], 3x4, as text: per camera an optional name and 12 numbers, over as many
/// lines as you like. Decomposed here.
#include <cmath>
#include <filesystem>
#include <sstream>

#include "tactus/base/error.h"
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool is_number(const std::string& word) {
  char* end = nullptr;
  std::strtod(word.c_str(), &end);
  return end != word.c_str() && *end == '\0';
}

bool recognise_projections(const Input& input) {
  if (input.is_folder || input.tree() != nullptr || input.text.find('\0') != std::string::npos) return false;
  std::istringstream in(input.text);
  std::string word;
  int numbers = 0, names = 0;
  while (in >> word) (is_number(word) ? numbers : names) += 1;
  return numbers >= 12 && numbers % 12 == 0 && names <= numbers / 12;
}

/// K upper triangular with positive diagonal and K(2,2) = 1, R a rotation: M = +-scale K R, by Gram-Schmidt
/// from the last row up.
void decompose(const double (&P)[12], const std::string& where, double unit_m, Camera& camera) {
  Mat3d M{{{P[0], P[1], P[2]}, {P[4], P[5], P[6]}, {P[8], P[9], P[10]}}};
  Vec3d p{P[3], P[7], P[11]};
  const double length3 = length(M.row[2]);
  if (!(length3 > 0) || !std::isfinite(length3))
    throw Error(where + ": the third row is zero: no perspective camera");
  // The scale makes the last row a unit vector; the sign makes R a rotation and no mirror.
  const double scale = (determinant(M) < 0 ? -1 : 1) / length3;
  M = scale * M;
  p *= scale;
  const Vec3d r3 = M.row[2];
  const double cy = dot(M.row[1], r3);
  const Vec3d y = M.row[1] - cy * r3;
  const double fy = length(y);
  const Vec3d r2 = (1 / fy) * y;
  const double cx = dot(M.row[0], r3), skew = dot(M.row[0], r2);
  const Vec3d x = M.row[0] - cx * r3 - skew * r2;
  const double fx = length(x);
  if (!(fx > 0) || !(fy > 0) || !std::isfinite(fx + fy))
    throw Error(where + ": the left 3x3 part is singular");
  camera.fx_px = fx;
  camera.fy_px = fy;
  camera.cx_px = cx;
  camera.cy_px = cy;
  camera.skew_px = std::abs(skew) < 1e-9 * fx ? 0 : skew;
  camera.T_cam_world.R = {{(1 / fx) * x, r2, r3}};
  const double tz = p.z, ty = (p.y - cy * tz) / fy, tx = (p.x - skew * ty - cx * tz) / fx;
  camera.T_cam_world.t = unit_m * Vec3d{tx, ty, tz};
}

std::vector<FileCamera> read_projections(const Input& input, const CalibrationAnswers& answers) {
  const Vec2i size = image_size(input.path, "projection matrix", {}, answers);
  const double unit_m = asked_unit_m(input.path, "projection matrix", answers);
  std::vector<FileCamera> cameras;
  std::istringstream in(input.text);
  std::string word, name;
  double P[12];
  int filled = 0;
  while (in >> word) {
    if (!is_number(word)) {
      if (filled > 0)
        throw Error(input.path + ": " + excerpt(word) + " after " + std::to_string(filled) +
                    " numbers of a matrix, expected 12");
      name = word;
      continue;
    }
    P[filled] = std::strtod(word.c_str(), nullptr);
    if (!std::isfinite(P[filled]))
      throw Error(input.path + ": " + excerpt(word) + ", expected a finite number");
    if (++filled < 12) continue;
    filled = 0;
    FileCamera c;
    const bool alone = cameras.empty() && name.empty() && in.peek() == std::char_traits<char>::eof();
    c.calibrated.camera.name = !name.empty() ? name
                               : alone       ? std::filesystem::path(input.path).stem().string()
                                             : std::to_string(cameras.size());
    set_size(c.calibrated.camera, size);
    decompose(P, input.path + ": camera '" + c.calibrated.camera.name + "'", unit_m, c.calibrated.camera);
    cameras.push_back(std::move(c));
    name.clear();
  }
  if (!input.text.ends_with('\n') && !cameras.empty())
    throw Error(input.path +
                ": the last line has no end; the file may be cut short (else end it with a newline)");
  if (!name.empty() && filled == 0)
    throw Error(input.path + ": no matrix after " + excerpt(name) + "; the file is cut short");
  if (filled != 0)
    throw Error(input.path + ": the last matrix has " + std::to_string(filled) +
                " numbers, expected 12; the file is cut short");
  return cameras;
}

}  // namespace

const Format kProjections{
    "projections",      "projection matrices P, 3x4, as text (name and 12 numbers per camera)",
    "unit, image size", recognise_projections,
    read_projections,   nullptr};

}  // namespace tactus::calibration

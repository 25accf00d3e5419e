/// Calibration boards in pictures: those that a lens bends, and how boards are named.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#if __has_include(<opencv2/calib3d.hpp>)
#include <opencv2/calib3d.hpp>
#endif
#include <opencv2/imgproc.hpp>

#include "support/message_of.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/rig/calibrate/board.h"

namespace tactus {
namespace {

using test::message_of;

#if __has_include(<opencv2/calib3d.hpp>)
/// Angles off the axis [rad] by distorted radius, in steps of 1/1000.
std::vector<double> fisheye_angles(const CalibratedCamera& camera) {
  std::vector<double> angles;
  double low = 0;
  for (int i = 0; i < 2500; ++i) {
    double high = 2;
    for (int k = 0; k < 40; ++k) {
      const double middle = 0.5 * (low + high), t2 = middle * middle;
      const auto& c = camera.lens.k;
      const double radius = middle * (1 + t2 * (c[0] + t2 * (c[1] + t2 * (c[2] + t2 * c[3]))));
      (radius < i / 1000.0 ? low : high) = middle;
    }
    if (high > 1.95) break;
    angles.push_back(low);
  }
  return angles;
}

/// What pictures of a set have in common.
struct BoardSet {
  const char* name;
  double view_deg;  ///< of the lens, over the width of the picture
  double tilt;      ///< of the board, about either axis [rad], at most
  double blur_px, noise;
};

/// Along 3x3 points of each pixel; zero beyond the lens.
std::vector<Vec3d> fisheye_rays(const CalibratedCamera& camera) {
  const Camera& c = camera.camera;
  const std::vector<double> angles = fisheye_angles(camera);
  const auto ray = [&](double x, double y) {
    const Vec2d at{(x - c.cx_px) / c.fx_px, (y - c.cy_px) / c.fy_px};
    const double radius = std::hypot(at.x, at.y), step = 1000 * radius;
    const auto i = static_cast<std::size_t>(step);
    if (i + 1 >= angles.size()) return Vec3d{};
    const double angle = angles[i] + (step - static_cast<double>(i)) * (angles[i + 1] - angles[i]);
    const double across = radius > 0 ? std::sin(angle) / radius : 1;
    return Vec3d{across * at.x, across * at.y, std::cos(angle)};
  };
  std::vector<Vec3d> rays;
  for (int y = 0; y < c.height_px; ++y)
    for (int x = 0; x < c.width_px; ++x)
      for (int s = 0; s < 9; ++s) rays.push_back(ray(x + (s % 3 - 1) / 3.0, y + (s / 3 - 1) / 3.0));
  return rays;
}

/// A picture of a board through a fisheye lens, on 3x3 points a pixel; its paper reaches one square beyond
/// the corners and another one in white.
cv::Mat picture_of_board(const Camera& c, const std::vector<Vec3d>& rays, const Board& board,
                         const Rigidd& T_cam_board, const BoardSet& set, unsigned seed) {
  const Vec3d n = T_cam_board.R.column(2);
  const Rigidd T_board_cam = inverse(T_cam_board);
  const auto grey_at = [&](Vec3d ray) {
    if (ray == Vec3d{}) return 20;
    const double depth = dot(n, T_cam_board.t) / dot(n, ray);
    if (!(depth > 0)) return 90;
    const Vec3d p = T_board_cam * (depth * ray);
    const double u = p.x / board.square_m, v = p.y / board.square_m;
    if (u < -2 || v < -2 || u > board.columns + 1 || v > board.rows + 1) return 90;
    if (u < -1 || v < -1 || u > board.columns || v > board.rows) return 235;
    return (static_cast<int>(std::floor(u)) + static_cast<int>(std::floor(v))) % 2 == 0 ? 25 : 235;
  };
  cv::Mat sharp(c.height_px, c.width_px, CV_32F), picture(c.height_px, c.width_px, CV_8U);
  auto ray = rays.begin();
  for (int y = 0; y < sharp.rows; ++y) {
    for (int x = 0; x < sharp.cols; ++x) {
      double sum = 0;
      for (int s = 0; s < 9; ++s) sum += grey_at(*ray++) / 9.0;
      sharp.at<float>(y, x) = static_cast<float>(sum);
    }
  }
  if (set.blur_px > 0) cv::GaussianBlur(sharp, sharp, {}, set.blur_px);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, set.noise);
  for (int y = 0; y < sharp.rows; ++y)
    for (int x = 0; x < sharp.cols; ++x)
      picture.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(static_cast<double>(sharp.at<float>(y, x)) + noise(random));
  return picture;
}

/// Where a fisheye lens shows the corners; none when the board is not whole in the picture, or a square is
/// shorter than 7 px.
std::vector<Vec2d> fisheye_corners(const CalibratedCamera& camera, const Board& board, const Rigidd& T) {
  const Camera& c = camera.camera;
  std::vector<Vec2d> px;
  for (Index j = -1; j <= board.rows; ++j) {
    for (Index i = -1; i <= board.columns; ++i) {
      const Vec3d p = T * Vec3d{i * board.square_m, j * board.square_m, 0};
      const double r = std::hypot(p.x, p.y), t = std::atan2(r, p.z), t2 = t * t;
      const auto& k = camera.lens.k;
      const double radius = t * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
      const Vec2d at{c.cx_px + c.fx_px * radius * p.x / r, c.cy_px + c.fy_px * radius * p.y / r};
      if (!(at.x > 3 && at.y > 3 && at.x < c.width_px - 4 && at.y < c.height_px - 4)) return {};
      if (i >= 0 && j >= 0 && i < board.columns && j < board.rows) px.push_back(at);
    }
  }
  for (std::size_t k = 1; k < px.size(); ++k) {
    const auto columns = static_cast<std::size_t>(board.columns);
    const auto is_short = [&](Vec2d a, Vec2d b) { return std::hypot(a.x - b.x, a.y - b.y) < 7; };
    if (k % columns != 0 && is_short(px[k], px[k - 1])) return {};
    if (k >= columns && is_short(px[k], px[k - columns])) return {};
  }
  return px;
}

double distance_px(cv::Point2f a, Vec2d b) {
  return std::hypot(static_cast<double>(a.x) - b.x, static_cast<double>(a.y) - b.y);
}

/// A picture, and its corners.
struct BoardPicture {
  cv::Mat grey;
  std::vector<Vec2d> truth;
};
std::vector<BoardPicture> pictures_of_set(const BoardSet& set, const Board& board, unsigned count) {
  CalibratedCamera camera;
  camera.camera.width_px = 640;
  camera.camera.height_px = 480;
  camera.camera.cx_px = 322;
  camera.camera.cy_px = 238;
  camera.lens = make_lens(LensModel::fisheye, std::vector{-0.02, 0.004, -0.002, 0.0});
  const double half = set.view_deg / 360 * M_PI, t2 = half * half;
  camera.camera.fx_px = camera.camera.fy_px = 320 / (half * (1 + t2 * (-0.02 + t2 * (0.004 - 0.002 * t2))));
  const std::vector<Vec3d> rays = fisheye_rays(camera);
  std::mt19937 random(
      static_cast<unsigned>(7 * set.view_deg + 100 * set.tilt + 10 * set.blur_px + set.noise));
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<BoardPicture> pictures;
  while (pictures.size() < count) {
    // It faces the camera from somewhere, then it is tilted.
    const double off = 0.8 * half * std::abs(uniform(random)), around = M_PI * uniform(random),
                 away = 10 + 6 * uniform(random);
    const Mat3d R =
        rotation_from_vector({-off * std::sin(around), off * std::cos(around), 0}) *
        rotation_from_vector({set.tilt * uniform(random), set.tilt * uniform(random), 0.6 * uniform(random)});
    const Vec3d middle =
        away * Vec3d{std::sin(off) * std::cos(around), std::sin(off) * std::sin(around), std::cos(off)};
    const Rigidd T{R, middle - R * Vec3d{4, 2.5, 0}};
    std::vector<Vec2d> truth = fisheye_corners(camera, board, T);
    if (truth.empty()) continue;
    const auto seed = static_cast<unsigned>(pictures.size());
    pictures.push_back({picture_of_board(camera.camera, rays, board, T, set, seed), std::move(truth)});
  }
  return pictures;
}

/// Half of the shortest square: nearer is the same corner.
constexpr double kSameCorner_px = 3.5;

/// How many pictures of a set a search finds with each corner nearer to its place than to any other's.
struct Found {
  unsigned pictures = 0;
  double sum_px2 = 0;
  int corners = 0;
};
Found find(const std::vector<BoardPicture>& pictures, const Board& board) {
  Found found;
  for (const BoardPicture& picture : pictures) {
    Image<std::uint8_t> grey(picture.grey.cols, picture.grey.rows);
    std::copy(picture.grey.data, picture.grey.data + picture.grey.total(), grey.pixels.begin());
    double worst_px = 1e9, sum_px2 = 0;
    const std::vector<BoardCorner> seen = detect_board(board, grey);
    for (const BoardCorner& corner : seen) {
      const Vec2d at = picture.truth.at(static_cast<std::size_t>(corner.id));
      const double off_px = std::hypot(at.x - corner.px.x, at.y - corner.px.y);
      worst_px = corner.id == 0 ? off_px : std::max(worst_px, off_px);
      sum_px2 += off_px * off_px;
    }
    if (worst_px >= kSameCorner_px) continue;
    ++found.pictures;
    found.sum_px2 += sum_px2;
    found.corners += static_cast<int>(seen.size());
  }
  return found;
}

/// The same of OpenCV's searches: by sectors, exhaustively, and by quadrangles.
std::array<unsigned, 3> opencv_finds(const std::vector<BoardPicture>& pictures) {
  std::array<unsigned, 3> found{};
  for (const BoardPicture& picture : pictures) {
    const std::vector<Vec2d>& truth = picture.truth;
    std::vector<cv::Point2f> corners;
    const auto is_right = [&] {
      if (corners.size() != truth.size()) return false;
      double forward_px = 0, backward_px = 0;  // it may begin at either end
      for (std::size_t i = 0; i < truth.size(); ++i) {
        forward_px = std::max(forward_px, distance_px(corners[i], truth[i]));
        backward_px = std::max(backward_px, distance_px(corners[i], truth[truth.size() - 1 - i]));
      }
      return std::min(forward_px, backward_px) < kSameCorner_px;
    };
    constexpr int kSectors = cv::CALIB_CB_NORMALIZE_IMAGE,
                  kExhaustive = kSectors | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY,
                  kQuadrangles = kSectors | cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_FAST_CHECK;
    found[0] += cv::findChessboardCornersSB(picture.grey, {9, 6}, corners, kSectors) && is_right();
    found[1] += cv::findChessboardCornersSB(picture.grey, {9, 6}, corners, kExhaustive) && is_right();
    found[2] += cv::findChessboardCorners(picture.grey, {9, 6}, corners, kQuadrangles) && is_right();
  }
  return found;
}

/// Boards that a fisheye lens bends, oblique, blurred and noisy: at least as many as the best of OpenCV's
/// searches finds, with each corner by its number. A straight line's picture has a radius of curvature of
/// about the focal length and more, 193 px of the widest lens; over half a window of at most 11 px it leaves
/// its tangent by 11^2 / (2 x 193) = 0.31 px, and corners, which are fitted to straight edges, are off by
/// less. Noise of 15 grey levels against edges of 210 adds 15 / 210 / sqrt(25 pixels) = 0.01 px.
TEST(Calibrate, FisheyeBoardsAreFoundAsByOpenCv) {
  const BoardSet sets[] = {{"wide", 120, 0.5, 0, 3},      {"tilted", 150, 1, 0, 3},
                           {"blurred", 170, 0.5, 1.5, 3}, {"noisy", 170, 0.5, 0.5, 15},
                           {"wider", 190, 1, 0, 3},       {"all of it", 190, 0.9, 1.2, 8}};
  const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  const Board board = parse_board("chessboard:9x6", 1, 0, false);
  for (const BoardSet& set : sets) {
    const std::vector<BoardPicture> pictures = pictures_of_set(set, board, is_long ? 24 : 6);
    const Found found = find(pictures, board);
    const double rms_px = std::sqrt(found.sum_px2 / std::max(found.corners, 1));
    std::printf("%s: %u of %zu, corners to %.2f px\n", set.name, found.pictures, pictures.size(), rms_px);
    EXPECT_LT(rms_px, 0.32) << set.name;
    // Nobody finds more than all, and OpenCV's searches take seconds.
    if (found.pictures == pictures.size() && !is_long) continue;
    const auto [sectors, exhaustive, quadrangles] = opencv_finds(pictures);
    std::printf("OpenCV: sectors %u, exhaustive %u, quadrangles %u\n", sectors, exhaustive, quadrangles);
    EXPECT_GE(found.pictures, std::max({sectors, exhaustive, quadrangles})) << set.name;
  }
}

#endif

TEST(Calibrate, BoardsAreParsed) {
  EXPECT_EQ(parse_board("chessboard:9x6", 0.025, 0, false).corner_count(), 54);
  EXPECT_EQ(parse_board("charuco:4x5:DICT_4X4_1000", 0.054, 0.04, true).corner_count(), 12);
  const auto message = [](const char* text, double marker = 0.04) {
    return message_of([&] { parse_board(text, 0.054, marker, false); }, ErrorKind::usage);
  };
  EXPECT_NE(message("chess:9x6").find("expected chessboard:9x6 (inner corners)"), std::string::npos);
  EXPECT_NE(message("charuco:4x5:4X4_51").find("did you mean '4X4_50'?"), std::string::npos);
  EXPECT_NE(message("charuco:4x5:4X4_50", 0.06).find("--marker-mm"), std::string::npos);
  EXPECT_NE(message("chessboard:1x6").find("3 to 100"), std::string::npos);
}

}  // namespace
}  // namespace tactus

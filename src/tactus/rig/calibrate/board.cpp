#include "tactus/rig/calibrate/board.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <opencv2/imgproc.hpp>
#ifdef TACTUS_WITH_CALIB3D
#include <opencv2/calib3d.hpp>
#endif
#ifdef TACTUS_WITH_ARUCO
#include <opencv2/aruco/charuco.hpp>
#endif

#include "tactus/base/error.h"
#include "tactus/rig/calibrate/board_grid.h"
#include "tactus/rig/marker_dictionaries.h"

namespace tactus {
namespace {

#ifdef TACTUS_WITH_CALIB3D
/// Brightness of the square whose first corner is `i`.
int square_of(const cv::Mat& grey, const std::vector<cv::Point2f>& corners, std::size_t i,
              std::size_t columns) {
  const cv::Point2f middle =
      0.25F * (corners[i] + corners[i + 1] + corners[i + columns] + corners[i + columns + 1]);
  const cv::Rect around(cvRound(middle.x) - 1, cvRound(middle.y) - 1, 3, 3);
  const cv::Rect inside = around & cv::Rect(0, 0, grey.cols, grey.rows);
  return inside.empty() ? 0 : static_cast<int>(cv::mean(grey(inside))[0]);
}

/// A board looks the same after half a turn, but for its colours where one side is odd and the other even:
/// there the first square is black, as findChessboardCorners has it; else the first corner is the upper one.
void orient(const cv::Mat& grey, cv::Size size, std::vector<cv::Point2f>& corners) {
  const auto columns = static_cast<std::size_t>(size.width);
  const bool by_color = (size.width + size.height) % 2 == 1;
  const bool turned = by_color ? square_of(grey, corners, 0, columns) >
                                     square_of(grey, corners, corners.size() - columns - 2, columns)
                               : corners.front().y > corners.back().y;
  if (turned) std::reverse(corners.begin(), corners.end());
}

std::vector<BoardCorner> numbered(const std::vector<cv::Point2f>& corners) {
  std::vector<BoardCorner> result;
  for (std::size_t i = 0; i < corners.size(); ++i)
    result.push_back(
        {static_cast<Index>(i), {static_cast<double>(corners[i].x), static_cast<double>(corners[i].y)}});
  return result;
}

/// Corners joined along their edges are found, however the lens bends the board. Where a few of them are
/// hidden, the two searches of OpenCV may still find the board: by sectors (Duda, Frese 2018), whose corners
/// need no refining, and by quadrangles. A lens bends rows smoothly, so a corner that stands out is in a
/// wrong place.
std::vector<BoardCorner> detect_chessboard(const Board& board, const cv::Mat& grey, int window_px) {
  const cv::Size size(board.columns, board.rows);
  std::vector<cv::Point2f> found = find_board_grid(grey, size, window_px);
  const auto is_smooth = [&] { return grid_roughness(found, size) <= kMostRoughness; };
  if (found.empty() &&
      !(cv::findChessboardCornersSB(grey, size, found, cv::CALIB_CB_NORMALIZE_IMAGE) && is_smooth())) {
    if (!cv::findChessboardCorners(
            grey, size, found,
            cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK))
      return {};
    constexpr float kMost_px = 5;  // quadrangles of blurred squares are smaller than these
    refine_board_grid(grey, size, window_px, kMost_px, found);
    if (!is_smooth()) return {};
  }
  orient(grey, size, found);
  return numbered(found);
}
#else
std::vector<BoardCorner> detect_chessboard(const Board&, const cv::Mat&, int) {
  throw Error(boards_missing());
}
#endif

#ifdef TACTUS_WITH_ARUCO
std::vector<BoardCorner> detect_charuco(const Board& board, const cv::Mat& grey) {
  const std::vector<std::string>& all = marker_dictionaries();
  const auto at = std::find(all.begin(), all.end(), board.dictionary) - all.begin();
  const auto dictionary = cv::aruco::getPredefinedDictionary(static_cast<int>(at));
  const auto charuco =
      cv::aruco::CharucoBoard::create(board.columns, board.rows, static_cast<float>(board.square_m),
                                      static_cast<float>(board.marker_m), dictionary);
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> markers;
  cv::aruco::detectMarkers(grey, dictionary, markers, ids);
  if (ids.empty()) return {};
  cv::Mat px, corner_ids;
  cv::aruco::interpolateCornersCharuco(markers, ids, grey, charuco, px, corner_ids, cv::noArray(),
                                       cv::noArray(), 1);
  std::vector<BoardCorner> corners;
  for (int i = 0; i < corner_ids.rows; ++i) {
    const auto& p = px.at<cv::Point2f>(i);
    corners.push_back({corner_ids.at<int>(i), {static_cast<double>(p.x), static_cast<double>(p.y)}});
  }
  return corners;
}
#endif

}  // namespace

std::string boards_missing() {
#ifdef TACTUS_WITH_CALIB3D
  return "";
#else
  return "boards can't be found: Tactus was built without OpenCV's calib3d (Debian: libopencv-calib3d-dev)";
#endif
}

std::string charuco_missing() {
#ifdef TACTUS_WITH_ARUCO
  return "";
#else
  return "ChArUco boards can't be found: Tactus was built without OpenCV's aruco (Debian: "
         "libopencv-contrib-dev)";
#endif
}

Board parse_board(const std::string& text, double square_m, double marker_m, bool inverted) {
  Board board;
  char dictionary[32] = "";
  if (std::sscanf(text.c_str(), "charuco:%dx%d:%31s", &board.columns, &board.rows, dictionary) == 3) {
    board.kind = BoardKind::charuco;
    board.dictionary = std::string(dictionary).starts_with("DICT_") ? dictionary + 5 : dictionary;
    const std::vector<std::string>& all = marker_dictionaries();
    if (std::find(all.begin(), all.end(), board.dictionary) == all.end())
      throw usage_error("--board '" + text + "': no dictionary '" + dictionary + "'" +
                        suggestion(board.dictionary, all));
    board.marker_m = marker_m;
    if (!(marker_m > 0 && marker_m < square_m))
      throw usage_error("--marker-mm: expected above 0 and below the square's " +
                        number_text(1e3 * square_m) + " mm");
  } else if (std::sscanf(text.c_str(), "chessboard:%dx%d", &board.columns, &board.rows) != 2) {
    throw usage_error("--board '" + text +
                      "': expected chessboard:9x6 (inner corners) or charuco:4x5:4X4_50 (squares)");
  }
  if (board.columns < 3 || board.rows < 3 || board.columns > 100 || board.rows > 100)
    throw usage_error("--board '" + text + "': expected 3 to 100 columns and rows");
  if (!(square_m > 0 && square_m < 100))
    throw usage_error("--square-mm " + number_text(1e3 * square_m) + ": expected above 0 and below 100000");
  board.square_m = square_m;
  board.inverted = inverted;
  return board;
}

std::vector<BoardCorner> detect_board(const Board& board, const Image<std::uint8_t>& picture, int window_px) {
  cv::Mat grey(picture.height_px, picture.width_px, CV_8U, const_cast<std::uint8_t*>(picture.pixels.data()));
  if (board.inverted) grey = 255 - grey;
  if (board.kind == BoardKind::chessboard) return detect_chessboard(board, grey, window_px);
#ifdef TACTUS_WITH_ARUCO
  return detect_charuco(board, grey);
#else
  throw Error(charuco_missing());
#endif
}

}  // namespace tactus

#pragma once
/// Calibration boards, and their corners in pictures.
#include <string>
#include <vector>

#include "tactus/geom/camera/lens.h"
#include "tactus/geom/image/image.h"

namespace tactus {

enum class BoardKind : std::uint8_t { chessboard, charuco };

/// A flat board. Its corners are numbered by rows from 0; corner i lies at `corner_m(i)` of the board's
/// frame, z = 0.
struct Board {
  BoardKind kind = BoardKind::chessboard;
  Index columns = 9, rows = 6;  ///< inner corners of a chessboard; squares of a ChArUco board
  double square_m = 1;
  double marker_m = 0.5;              ///< ChArUco: side of a marker
  std::string dictionary = "4X4_50";  ///< ChArUco: of OpenCV's predefined ones, without DICT_
  bool inverted = false;              ///< printed white on black
  Vec2i inner() const {
    return kind == BoardKind::chessboard ? Vec2i{columns, rows} : Vec2i{columns - 1, rows - 1};
  }
  Index corner_count() const { return inner().x * inner().y; }
  /// A ChArUco board's origin is the corner of its first square, a chessboard's its first inner corner.
  Vec3d corner_m(Index i) const {
    const double first = kind == BoardKind::chessboard ? 0 : 1;
    return {square_m * (first + i % inner().x), square_m * (first + i / inner().x), 0};
  }
};
/// "chessboard:9x6" (inner corners) or "charuco:4x5:4X4_50" (squares, dictionary).
/// @throws usage Error naming the wrong part.
Board parse_board(const std::string& text, double square_m, double marker_m, bool inverted);

struct BoardCorner {
  Index id = 0;
  Vec2d px;
};
/// One board, seen by one camera at one instant.
struct BoardView {
  Index camera = 0, instant = 0;
  std::vector<BoardCorner> corners;
};

/// Corners of the board in a grey picture, to a fraction of a pixel; none where it isn't seen. A chessboard
/// is seen whole or not at all.
/// @param window_px half the window in which a chessboard's corner is refined; 0: as much as the squares
/// around it allow, at most 11  @throws Error for ChArUco where Tactus was built without OpenCV's aruco.
std::vector<BoardCorner> detect_board(const Board& board, const Image<std::uint8_t>& grey, int window_px = 0);
/// Why ChArUco boards can't be found by this build; "" when they can.
std::string charuco_missing();
/// Likewise for chessboards, and poses of boards.
std::string boards_missing();

}  // namespace tactus

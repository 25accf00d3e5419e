#pragma once
/// Boards in pictures and films.
#include <functional>
#include <string>
#include <vector>

#include "tactus/rig/calibrate/board.h"

namespace tactus {

struct BoardPictures {
  std::vector<BoardView> views;
  std::vector<Vec2i> size_px;        ///< by camera
  std::vector<Index> picture_count;  ///< by camera: pictures that were looked at
  Index instants = 0;
};
struct BoardPictureOptions {
  Index step = 1;  ///< every so many frames of films are looked at
  /// Called after each picture, one thread at a time: camera, pictures done of so many (0: not known).
  std::function<void(Index, Index, Index)> progress = {};
};

/// Looks for the board in every camera's pictures: a film, a picture, or a pattern with one %d. Frames of the
/// same number are one instant. Cameras run side by side. @throws Error naming the file; or when a film's
/// size changes.
BoardPictures find_boards(const Board& board, const std::vector<std::string>& pictures,
                          const BoardPictureOptions& options);

/// @throws Error naming the file as read_image.
Image<std::uint8_t> read_grey(const std::string& file);

}  // namespace tactus

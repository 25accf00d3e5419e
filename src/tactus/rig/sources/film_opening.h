#pragma once
/// Opens films of cameras, with one form of error message. For the files of this folder.
#include <opencv2/core/mat.hpp>
#include <string>

#include "tactus/media/film_reader.h"

namespace tactus {

/// @throws Error naming the file (and the nearest name): missing, cut short or not a film.
FilmReader open_film(const std::string& file);

/// A frame's pixels, in OpenCV's order of colours; they stay the frame's.
cv::Mat view_of(FilmFrame& frame);

}  // namespace tactus

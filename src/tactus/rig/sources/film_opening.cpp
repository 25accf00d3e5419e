#include "tactus/rig/sources/film_opening.h"

#include "tactus/base/error.h"
#include "tactus/rig/images/numbered_files.h"

namespace tactus {

FilmReader open_film(const std::string& file) {
  if (!is_file(file)) throw Error(file + ": no such video" + suggest_file(file));
  try {
    return FilmReader(file);
  } catch (const Error& error) {
    throw Error(file + ": not a video that can be read (" + error.what() + ")");
  }
}

cv::Mat view_of(FilmFrame& frame) { return {frame.height_px, frame.width_px, CV_8UC3, frame.bgr.data()}; }

}  // namespace tactus

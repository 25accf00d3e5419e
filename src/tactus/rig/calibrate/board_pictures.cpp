#include "tactus/rig/calibrate/board_pictures.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <opencv2/imgproc.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/images/image_reading.h"
#include "tactus/rig/images/numbered_files.h"
#include "tactus/rig/sources/film_opening.h"

namespace tactus {
namespace {

Image<std::uint8_t> to_image(const cv::Mat& grey) {
  Image<std::uint8_t> image(grey.cols, grey.rows);
  for (int y = 0; y < grey.rows; ++y) std::copy(grey.ptr(y), grey.ptr(y) + grey.cols, &image(0, y));
  return image;
}

bool is_film(const std::string& path) {
  std::string end = std::filesystem::path(path).extension();
  std::transform(end.begin(), end.end(), end.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  static const std::vector<std::string> kFilms{".mp4", ".avi", ".mov", ".mkv", ".m4v", ".webm", ".mpg"};
  return std::find(kFilms.begin(), kFilms.end(), end) != kFilms.end();
}

/// Hands every picture of one camera to `use`, with its number and how many there are (0: not known).
void for_pictures(const std::string& path, Index step,
                  const std::function<void(Index, Index, const Image<std::uint8_t>&)>& use) {
  if (!is_film(path)) {
    const NumberedFiles files(path);
    const std::vector<int> numbers = files.is_sequence() ? files.numbers() : std::vector<int>{0};
    const int pictures = numbers.back() - numbers.front() + 1;  // sequences may have holes
    for (const int i : numbers) use(i, pictures, read_grey(files.file(i)));
    return;
  }
  FilmReader film = open_film(path);
  const Index count = film.frame_count();
  FilmFrame frame;
  cv::Mat grey;
  for (Index i = 0;; ++i) {
    if (!(i % step == 0 ? film.read(frame) : film.skip())) break;
    if (i % step != 0) continue;
    cv::cvtColor(view_of(frame), grey, cv::COLOR_BGR2GRAY);
    use(i, count / step, to_image(grey));
  }
}

}  // namespace

Image<std::uint8_t> read_grey(const std::string& file) { return to_image(read_image(file, ReadAs::grey)); }

BoardPictures find_boards(const Board& board, const std::vector<std::string>& pictures,
                          const BoardPictureOptions& options) {
  BoardPictures found;
  found.size_px.resize(pictures.size());
  found.picture_count.resize(pictures.size());
  std::vector<std::vector<BoardView>> views(pictures.size());
  std::mutex mutex;
  tbb::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t c) {
    for_pictures(pictures[c], std::max<Index>(1, options.step),
                 [&](Index instant, Index of, const Image<std::uint8_t>& grey) {
                   const Vec2i size{grey.width_px, grey.height_px};
                   if (found.picture_count[c] > 0 && size != found.size_px[c]) {
                     throw Error(pictures[c] + ": picture " + std::to_string(instant) + " has " +
                                 std::to_string(size.x) + "x" + std::to_string(size.y) +
                                 " pixels, the first " + std::to_string(found.size_px[c].x) + "x" +
                                 std::to_string(found.size_px[c].y));
                   }
                   found.size_px[c] = size;
                   ++found.picture_count[c];
                   BoardView view{static_cast<Index>(c), instant, detect_board(board, grey)};
                   if (!view.corners.empty()) views[c].push_back(std::move(view));
                   const std::lock_guard lock(mutex);
                   if (options.progress) options.progress(static_cast<Index>(c), found.picture_count[c], of);
                 });
    if (found.picture_count[c] == 0) throw Error(pictures[c] + ": no picture in it can be read");
  });
  for (auto& list : views) {
    for (BoardView& view : list) {
      found.instants = std::max(found.instants, view.instant + 1);
      found.views.push_back(std::move(view));
    }
  }
  return found;
}

}  // namespace tactus

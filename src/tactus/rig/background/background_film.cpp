#include "tactus/rig/background/background_film.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgproc.hpp>

#include "tactus/base/error.h"
#include "tactus/media/film_reader.h"
#include "tactus/rig/images/image_reading.h"
#include "tactus/rig/images/numbered_files.h"
#include "tactus/rig/sources/film_opening.h"

namespace tactus {
namespace {

constexpr int kMedianFrames = 31;

bool is_picture(const std::string& file) {
  const std::string end = std::filesystem::path(file).extension().string();
  return end == ".png" || end == ".jpg" || end == ".jpeg" || end == ".bmp";
}

double sharpness_of(const cv::Mat& photo) {
  cv::Mat grey, laplacian, mean, deviation;
  cv::cvtColor(photo, grey, cv::COLOR_BGR2GRAY);
  cv::Laplacian(grey, laplacian, CV_64F);
  cv::meanStdDev(laplacian, mean, deviation);
  return deviation.at<double>(0);
}

}  // namespace

LearntRoom learn_room(const std::string& film, bool median) {
  if (is_picture(film)) {
    const cv::Mat photo = read_image(film, ReadAs::color);
    LearntRoom room{
        BackgroundModel(photo.cols, photo.rows), photo.cols, photo.rows, 1, 0, sharpness_of(photo)};
    room.model.learn(photo.data);
    return room;
  }
  if (!is_file(film)) throw Error(film + ": no such film" + suggest_file(film));
  FilmReader video = open_film(film);
  FilmFrame frame;
  if (!video.read(frame)) throw Error(film + ": no frame of the film can be read");
  cv::Mat photo = view_of(frame);
  const int reported = video.frame_count();
  const int stride = median ? std::max(reported / kMedianFrames, 1) : 1;
  LearntRoom room{BackgroundModel(photo.cols, photo.rows), photo.cols, photo.rows, 0, 0, sharpness_of(photo)};
  double sum = 0, sum2 = 0;
  do {
    photo = view_of(frame);
    if (photo.cols != room.width_px || photo.rows != room.height_px) break;
    const cv::Scalar mean = cv::mean(photo);
    const double brightness = (mean[0] + mean[1] + mean[2]) / 3;
    sum += brightness;
    sum2 += brightness * brightness;
    if (!median)
      room.model.learn(photo.data);
    else if (room.frames % stride == 0)
      room.model.collect(photo.data);
    ++room.frames;
  } while (video.read(frame));
  if (median) room.model.finish_median();
  const double n = room.frames;
  room.flicker = std::sqrt(std::max(sum2 / n - sqr(sum / n), 0.0));
  return room;
}

}  // namespace tactus

#include "tactus/rig/markers.h"

#include <tbb/parallel_for.h>

#include <opencv2/imgproc.hpp>
#ifdef TACTUS_WITH_ARUCO
#include <opencv2/aruco.hpp>
#endif

#include "tactus/base/error.h"
#include "tactus/rig/marker_dictionaries.h"

namespace tactus {
namespace {

#ifdef TACTUS_WITH_ARUCO
std::vector<SeenMarker> find_in(const ColorImage& picture, int camera,
                                const cv::Ptr<cv::aruco::Dictionary>& dictionary) {
  const cv::Mat rgb(picture.height_px, picture.width_px, CV_8UC3, const_cast<Rgb8*>(picture.pixels.data()));
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  const auto parameters = cv::aruco::DetectorParameters::create();
  // Lines through the sides: the fields of a small marker are nearer to its corners than a window is wide.
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_CONTOUR;
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;
  cv::aruco::detectMarkers(grey, dictionary, corners, ids, parameters);
  std::vector<SeenMarker> found;
  for (std::size_t m = 0; m < ids.size(); ++m) {
    SeenMarker& marker = found.emplace_back();
    marker.camera = camera;
    marker.id = ids[m];
    for (std::size_t k = 0; k < 4; ++k)
      marker.corners_px.at(k) = {static_cast<double>(corners[m][k].x), static_cast<double>(corners[m][k].y)};
  }
  return found;
}
#endif

}  // namespace

std::string markers_missing() {
#ifdef TACTUS_WITH_ARUCO
  return "";
#else
  return "markers can't be found: Tactus was built without OpenCV's aruco (Debian: libopencv-contrib-dev)";
#endif
}

std::vector<SeenMarker> find_markers([[maybe_unused]] std::span<const ColorImage> pictures,
                                     const std::string& dictionary) {
  [[maybe_unused]] const int number = marker_dictionary(dictionary);
#ifdef TACTUS_WITH_ARUCO
  const auto of = cv::aruco::getPredefinedDictionary(number);
  std::vector<std::vector<SeenMarker>> found(pictures.size());
  tbb::parallel_for(std::size_t{0}, pictures.size(), [&](std::size_t c) {
    if (!pictures[c].empty()) found[c] = find_in(pictures[c], static_cast<int>(c), of);
  });
  std::vector<SeenMarker> all;
  for (const auto& own : found) all.insert(all.end(), own.begin(), own.end());
  return all;
#else
  throw Error(markers_missing());
#endif
}

}  // namespace tactus

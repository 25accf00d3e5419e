#include "tactus/rig/metric_evidence.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <set>
#include <sstream>
#ifdef TACTUS_WITH_CALIB3D
#include <opencv2/calib3d.hpp>
#endif

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/rig/calibrate/board.h"

namespace tactus {
namespace {

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) {
    if (c == ',')
      cells.emplace_back();
    else if (c != '\r' && c != ' ')
      cells.back() += c;
  }
  return cells;
}

double number_of(const std::string& cell, const std::string& where) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(value))
    throw Error(where + ": '" + cell + "', expected a number");
  return value;
}

}  // namespace

std::vector<Vec2d> read_clicked_corners(const std::string& file, const ClickedBoard& board) {
  cv::FileStorage storage;
  try {
    storage.open(file, cv::FileStorage::READ);
  } catch (const cv::Exception&) {
    throw Error(file + ": not an OpenCV XML or YAML file");
  }
  if (!storage.isOpened()) throw Error(file + ": no such file, or not an OpenCV XML or YAML file");
  std::vector<Vec2d> corners;
  for (int i = 0; i < board.columns * board.rows; ++i) {
    const std::string name = "Corner_" + std::to_string(i);
    const cv::FileNode node = storage[name];
    std::vector<double> values;
    if (node.isSeq()) {
      node >> values;
    } else if (node.isString()) {  // XML: "388 340"
      const std::string text = node.string();
      double x = 0, y = 0;
      if (std::sscanf(text.c_str(), "%lf %lf", &x, &y) == 2) values = {x, y};
    }
    if (values.size() != 2)
      throw Error(file + ": '" + name + "': expected two numbers, and " +
                  std::to_string(board.columns * board.rows) + " corners for a board of " +
                  std::to_string(board.columns) + "x" + std::to_string(board.rows));
    corners.push_back({values[0], values[1]});
  }
  return corners;
}

#ifdef TACTUS_WITH_CALIB3D
BoardPose pose_from_board(const CalibratedCamera& calibrated, const ClickedBoard& board,
                          const std::vector<Vec2d>& corners_px) {
  const Camera& c = calibrated.camera;
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> ideal;  // the lens undone by our own formulas, so any of its models will do
  for (std::size_t i = 0; i < corners_px.size(); ++i) {
    const auto column = static_cast<double>(i % static_cast<std::size_t>(board.columns)),
               row = static_cast<double>(i / static_cast<std::size_t>(board.columns));
    const double y = (corners_px[i].y - c.cy_px) / c.fy_px,
                 x = (corners_px[i].x - c.cx_px - c.skew_px * y) / c.fx_px;
    const std::optional<Vec2d> at = calibrated.lens.undistort({x, y});
    if (!at) continue;
    points.emplace_back(column * board.square_m, row * board.square_m, 0);
    ideal.emplace_back(at->x, at->y);
  }
  cv::Mat rotation, translation;
  if (points.size() < 4 || !cv::solvePnP(points, ideal, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotation,
                                         translation, false, cv::SOLVEPNP_IPPE))
    throw Error("camera '" + c.name + "': no pose fits the clicked corners");
  cv::solvePnPRefineLM(points, ideal, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotation, translation);
  std::vector<cv::Point2d> seen;
  cv::projectPoints(points, rotation, translation, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), seen);
  BoardPose pose;
  for (std::size_t i = 0; i < seen.size(); ++i)
    pose.rms_px += (sqr(c.fx_px * (seen[i].x - ideal[i].x)) + sqr(c.fy_px * (seen[i].y - ideal[i].y))) /
                   static_cast<double>(seen.size());
  pose.rms_px = std::sqrt(pose.rms_px);
  cv::Mat R;
  cv::Rodrigues(rotation, R);
  const cv::Mat center = -R.t() * translation;
  pose.center_m = {center.at<double>(0), center.at<double>(1), center.at<double>(2)};
  return pose;
}
#else
BoardPose pose_from_board(const CalibratedCamera&, const ClickedBoard&, const std::vector<Vec2d>&) {
  throw Error(boards_missing());
}
#endif

FrameSkew read_frame_skew(const std::string& file) {
  std::istringstream in(read_text(file, kMaxCalibrationBytes));
  std::string line;
  if (!std::getline(in, line)) throw Error(file + ": the file is empty");
  const std::vector<std::string> header = cells_of(line);
  const auto column = [&](const std::string& name) {
    const auto at = std::find(header.begin(), header.end(), name);
    if (at == header.end())
      throw Error(file + ":1: no column '" + name + "'" + suggestion(name, header) +
                  "; expected sync_index, cam_id, frame_time");
    return static_cast<std::size_t>(at - header.begin());
  };
  const std::size_t tick_column = column("sync_index"), camera_column = column("cam_id"),
                    time_column = column("frame_time");
  struct Span {
    double first_s = 1e300, last_s = -1e300;
    int frames = 0;
  };
  std::map<long long, Span> ticks;
  std::set<std::string> cameras;
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.empty()) continue;
    const std::vector<std::string> cells = cells_of(line);
    const std::string where = file + ":" + std::to_string(number);
    if (cells.size() < header.size())
      throw Error(where + ": " + std::to_string(cells.size()) + " columns, expected " +
                  std::to_string(header.size()));
    if (cells[time_column].empty()) continue;  // a dropped frame
    const double time_s = number_of(cells[time_column], where);
    Span& span = ticks[static_cast<long long>(number_of(cells[tick_column], where))];
    span.first_s = std::min(span.first_s, time_s);
    span.last_s = std::max(span.last_s, time_s);
    ++span.frames;
    cameras.insert(cells[camera_column]);
  }
  std::vector<double> skews_ms;
  for (const auto& [tick, span] : ticks) {
    if (span.frames > 1) skews_ms.push_back(1000 * (span.last_s - span.first_s));
  }
  if (skews_ms.empty()) throw Error(file + ": no tick with two cameras");
  std::sort(skews_ms.begin(), skews_ms.end());
  return {skews_ms[skews_ms.size() / 2], skews_ms.back(), skews_ms.size(), cameras.size()};
}

}  // namespace tactus

#pragma once
/// Inner corners of a chessboard that a lens may bend, found one by one and joined along their edges.
/// Internal to calibrate/.
#include <opencv2/core.hpp>
#include <vector>

namespace tactus {

/// The corners by rows, `size.width` a row; the columns run clockwise of the rows in the picture. Which end
/// is first is not known. Empty where no whole board is seen.
/// @param window_px half the window in which a corner is refined; 0: as much as the squares around it allow,
/// at most 11
std::vector<cv::Point2f> find_board_grid(const cv::Mat& grey, cv::Size size, int window_px);

/// The largest third difference along a row or column over the distance of corners there. A board, however a
/// lens bends it, has some hundredths; a corner in a wrong place has its distance from the right one, and
/// more.
double grid_roughness(const std::vector<cv::Point2f>& corners, cv::Size size);
/// Boards of the fisheye test have up to 0.15, with a wrong corner 0.4 and more.
inline constexpr double kMostRoughness = 0.3;

/// Moves each corner to the saddle near it, not farther than `most_px` in windows of its own choice.
void refine_board_grid(const cv::Mat& grey, cv::Size size, int window_px, float most_px,
                       std::vector<cv::Point2f>& corners);

}  // namespace tactus

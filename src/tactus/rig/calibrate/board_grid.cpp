#include "tactus/rig/calibrate/board_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

namespace tactus {
namespace {

constexpr float kHalfTurn = 3.14159265358979F;
constexpr std::size_t kMostPeaks = 4000, kMostCrossings = 1200;
/// Grey levels between dark and bright squares; between the two sides of an edge.
constexpr float kLeastContrast = 16, kLeastStep = 8;
/// Least -det of the Hessian: at a peak, and where a corner is expected.
constexpr float kLeastSaddle = 0.5F, kFaintSaddle = 0.2F;
constexpr int kBorder_px = 5;
/// Share of the corners from which the others are looked for.
constexpr double kLeastGridPart = 2.0 / 3;

float wrapped(float angle) { return std::remainder(angle, 2 * kHalfTurn); }

/// Where four squares meet.
struct Crossing {
  cv::Point2f at;
  std::array<float, 4> edges{};  ///< directions of edges, growing angles (clockwise in the picture)
  bool is_bright = false;        ///< the square between the first two
  std::array<int, 4> next{-1, -1, -1, -1};  ///< the crossing at the other end of each edge
  /// Whether it is bright on the side of growing angles of an edge.
  bool bright_after(int edge) const { return (edge % 2 == 0) == is_bright; }
};

float value_at(const cv::Mat& image, cv::Point2f p) {
  const int i = cvFloor(p.x), j = cvFloor(p.y);
  if (i < 0 || j < 0 || i + 1 >= image.cols || j + 1 >= image.rows) return -1;
  const float u = p.x - static_cast<float>(i), v = p.y - static_cast<float>(j);
  const auto *upper = image.ptr<float>(j) + i, *lower = image.ptr<float>(j + 1) + i;
  return (1 - v) * ((1 - u) * upper[0] + u * upper[1]) + v * ((1 - u) * lower[0] + u * lower[1]);
}

/// Around a crossing, dark and bright change four times; opposite edges are about half a turn apart.
bool is_crossing(const cv::Mat& grey, cv::Point2f p, float radius_px, Crossing& out) {
  constexpr int kRingSamples = 40;
  std::array<float, kRingSamples> ring{};
  for (int k = 0; k < kRingSamples; ++k) {
    const float a = 2 * kHalfTurn * static_cast<float>(k) / kRingSamples;
    ring[static_cast<std::size_t>(k)] = value_at(grey, p + radius_px * cv::Point2f(std::cos(a), std::sin(a)));
  }
  const auto [low, high] = std::minmax_element(ring.begin(), ring.end());
  if (*low < 0 || *high - *low < kLeastContrast) return false;
  const float middle = 0.5F * (*low + *high);
  std::size_t changes = 0;
  bool first_rises = false;
  std::array<float, 4> at{};
  for (int k = 0; k < kRingSamples; ++k) {
    const float a = ring[static_cast<std::size_t>(k)] - middle,
                b = ring[static_cast<std::size_t>((k + 1) % kRingSamples)] - middle;
    if ((a < 0) == (b < 0)) continue;
    if (changes == 4) return false;
    if (changes == 0) first_rises = b >= 0;
    at[changes++] = 2 * kHalfTurn * (static_cast<float>(k) + a / (a - b)) / kRingSamples;
  }
  if (changes != 4) return false;
  for (std::size_t k = 0; k < 2; ++k)
    if (std::abs(wrapped(at[k + 2] - at[k] - kHalfTurn)) > 0.6F) return false;
  for (std::size_t k = 0; k < 4; ++k)
    if (at[(k + 1) % 4] - at[k] + (k == 3 ? 2 * kHalfTurn : 0) < 0.3F) return false;
  out.at = p;
  out.edges = at;
  out.is_bright = first_rises;
  return true;
}

/// A picture, smoothed, and how much each pixel is a saddle: -det of the Hessian.
struct Saddles {
  cv::Mat grey, smooth, xx, yy, xy, saddle;
  explicit Saddles(const cv::Mat& picture) {
    cv::Mat values;
    picture.convertTo(values, CV_32F);
    cv::GaussianBlur(values, grey, {}, 1.2);
    cv::GaussianBlur(values, smooth, {}, 1.8);
    cv::Sobel(smooth, xx, CV_32F, 2, 0, 3, 0.25);
    cv::Sobel(smooth, yy, CV_32F, 0, 2, 3, 0.25);
    cv::Sobel(smooth, xy, CV_32F, 1, 1, 3, 0.25);
    saddle = xy.mul(xy) - xx.mul(yy);
  }
  bool holds(int x, int y) const {
    return x >= kBorder_px && y >= kBorder_px && x < saddle.cols - kBorder_px && y < saddle.rows - kBorder_px;
  }
  /// The saddle point of the quadric there; none when it is farther than two pixels.
  std::optional<cv::Point2f> point(int x, int y) const {
    const float dx = 0.5F * (smooth.at<float>(y, x + 1) - smooth.at<float>(y, x - 1)),
                dy = 0.5F * (smooth.at<float>(y + 1, x) - smooth.at<float>(y - 1, x)), a = xx.at<float>(y, x),
                b = yy.at<float>(y, x), c = xy.at<float>(y, x), d = a * b - c * c;
    if (!(d < 0)) return {};
    const cv::Point2f off((c * dy - b * dx) / d, (c * dx - a * dy) / d);
    if (std::abs(off.x) > 2 || std::abs(off.y) > 2) return {};
    return cv::Point2f(static_cast<float>(x), static_cast<float>(y)) + off;
  }
  /// @param spacing_px of corners there; 0: not known
  bool is_crossing_at(cv::Point2f p, float spacing_px, Crossing& out) const {
    for (const float radius_px : {5.F, 3.5F, 2.5F, 8.F}) {
      if (spacing_px > 0 ? radius_px > 0.6F * spacing_px : radius_px < 3) continue;
      if (is_crossing(grey, p, radius_px, out)) return true;
    }
    return false;
  }
  /// The crossing nearest to a place, within a quarter of the spacing.
  std::optional<cv::Point2f> crossing_near(cv::Point2f place, float spacing_px) const {
    const int reach = std::max(2, cvRound(0.25F * spacing_px));
    std::optional<cv::Point2f> best;
    float nearest = 1e9F;
    Crossing crossing;
    for (int y = cvRound(place.y) - reach; y <= cvRound(place.y) + reach; ++y) {
      for (int x = cvRound(place.x) - reach; x <= cvRound(place.x) + reach; ++x) {
        if (!holds(x, y) || saddle.at<float>(y, x) < kFaintSaddle) continue;
        const cv::Rect around(x - 1, y - 1, 3, 3);
        double most = 0;
        cv::minMaxLoc(saddle(around), nullptr, &most);
        if (static_cast<double>(saddle.at<float>(y, x)) < most) continue;
        const cv::Point2f at =
            point(x, y).value_or(cv::Point2f(static_cast<float>(x), static_cast<float>(y)));
        const auto off = static_cast<float>(cv::norm(at - place));
        if (off >= nearest || !is_crossing_at(at, spacing_px, crossing)) continue;
        nearest = off;
        best = at;
      }
    }
    return best;
  }
};

std::vector<Crossing> find_crossings(const Saddles& s) {
  cv::Mat highest;
  cv::dilate(s.saddle, highest, cv::Mat::ones(5, 5, CV_8U));
  std::vector<std::pair<float, cv::Point>> peaks;
  for (int y = kBorder_px; y < s.saddle.rows - kBorder_px; ++y) {
    for (int x = kBorder_px; x < s.saddle.cols - kBorder_px; ++x) {
      const float v = s.saddle.at<float>(y, x);
      if (v > kLeastSaddle && v >= highest.at<float>(y, x)) peaks.push_back({v, {x, y}});
    }
  }
  std::sort(peaks.begin(), peaks.end(), [](const auto& a, const auto& b) {
    return std::tuple(-a.first, a.second.y, a.second.x) < std::tuple(-b.first, b.second.y, b.second.x);
  });
  if (peaks.size() > kMostPeaks) peaks.resize(kMostPeaks);
  std::vector<Crossing> found;
  for (const auto& [strength, pixel] : peaks) {
    if (found.size() == kMostCrossings) break;
    const std::optional<cv::Point2f> at = s.point(pixel.x, pixel.y);
    Crossing c;
    if (!at || !s.is_crossing_at(*at, 0, c)) continue;
    if (std::none_of(found.begin(), found.end(),
                     [&](const Crossing& other) { return cv::norm(other.at - c.at) < 3; }))
      found.push_back(c);
  }
  return found;
}

/// Whether an edge of `a` may end at `b`: edges point at one another, and sides have one colour all along.
bool is_edge(const Saddles& s, const Crossing& a, int edge, const Crossing& b) {
  const cv::Point2f d = b.at - a.at;
  const float angle = std::atan2(d.y, d.x), way_px = std::hypot(d.x, d.y);
  int back = -1;
  for (int k = 0; k < 4; ++k)
    if (std::abs(wrapped(angle + kHalfTurn - b.edges[static_cast<std::size_t>(k)])) < 0.4F) back = k;
  if (back < 0 || a.bright_after(edge) == b.bright_after(back)) return false;
  const cv::Point2f middle = 0.5F * (a.at + b.at), side = 0.22F * cv::Point2f(-d.y, d.x);
  const float after = value_at(s.grey, middle + side), before = value_at(s.grey, middle - side);
  return way_px > 0 && after >= 0 && before >= 0 && (after > before) == a.bright_after(edge) &&
         std::abs(after - before) >= kLeastStep;
}

/// Each edge ends at the nearest crossing that it may end at.
void join(const Saddles& s, std::vector<Crossing>& all) {
  for (Crossing& a : all) {
    for (int k = 0; k < 4; ++k) {
      const float angle = a.edges[static_cast<std::size_t>(k)];
      const cv::Point2f along(std::cos(angle), std::sin(angle));
      float nearest = 1e9F;
      for (std::size_t b = 0; b < all.size(); ++b) {
        const cv::Point2f d = all[b].at - a.at;
        const float way_px = std::hypot(d.x, d.y);
        if (way_px >= nearest || way_px < 4 || d.dot(along) < 0.94F * way_px) continue;  // 20 degrees
        if (!is_edge(s, a, k, all[b])) continue;
        nearest = way_px;
        a.next[static_cast<std::size_t>(k)] = static_cast<int>(b);
      }
    }
  }
}

using Places = std::map<std::pair<int, int>, cv::Point2f>;
constexpr std::array<int, 4> kStepX{1, 0, -1, 0}, kStepY{0, 1, 0, -1};

/// The crossings that are connected to `first`, by columns and rows. An edge counts if both of its ends list
/// it.
Places places_from(const std::vector<Crossing>& all, std::size_t first, std::vector<bool>& is_taken) {
  struct Step {
    std::size_t at;
    int turn, x, y;  ///< its edge k goes in direction k + turn
  };
  Places places{{{0, 0}, all[first].at}};
  std::deque<Step> open{{first, 0, 0, 0}};
  is_taken[first] = true;
  while (!open.empty()) {
    const Step from = open.front();
    open.pop_front();
    for (int k = 0; k < 4; ++k) {
      const int next = all[from.at].next[static_cast<std::size_t>(k)];
      if (next < 0 || is_taken[static_cast<std::size_t>(next)]) continue;
      const auto b = static_cast<std::size_t>(next);
      const auto back = std::find(all[b].next.begin(), all[b].next.end(), static_cast<int>(from.at));
      if (back == all[b].next.end()) continue;
      const int direction = (k + from.turn) & 3;
      const auto d = static_cast<std::size_t>(direction);
      const std::pair place{from.x + kStepX[d], from.y + kStepY[d]};
      if (!places.emplace(place, all[b].at).second) continue;
      is_taken[b] = true;
      const auto m = static_cast<int>(back - all[b].next.begin());
      open.push_back({b, (direction + 2 - m + 4) & 3, place.first, place.second});
    }
  }
  return places;
}

/// Adds crossings that were too faint, beside two or three of a line.
void fill(const Saddles& s, Places& places) {
  for (int round = 0; round < 12; ++round) {
    Places added;
    for (const auto& [place, p] : places) {
      for (std::size_t k = 0; k < 4; ++k) {
        const std::pair beyond{place.first + kStepX[k], place.second + kStepY[k]};
        if (places.contains(beyond) || added.contains(beyond)) continue;
        const auto one = places.find({place.first - kStepX[k], place.second - kStepY[k]});
        if (one == places.end()) continue;
        const auto two = places.find({place.first - 2 * kStepX[k], place.second - 2 * kStepY[k]});
        const cv::Point2f expected =
            two == places.end() ? 2 * p - one->second : 3 * p - 3 * one->second + two->second;
        const auto at = s.crossing_near(expected, static_cast<float>(cv::norm(p - one->second)));
        if (at) added[beyond] = *at;
      }
    }
    if (added.empty()) return;
    places.insert(added.begin(), added.end());
  }
}

/// The smoothest part of `places` that is a whole board.
std::vector<cv::Point2f> whole_board(const Places& places, cv::Size size) {
  cv::Point low(1 << 20, 1 << 20), high(-(1 << 20), -(1 << 20));
  for (const auto& [place, p] : places) {
    low = {std::min(low.x, place.first), std::min(low.y, place.second)};
    high = {std::max(high.x, place.first), std::max(high.y, place.second)};
  }
  std::vector<cv::Point2f> best;
  double least = 1e9;
  for (const bool turned : {false, true}) {
    const int wide = turned ? size.height : size.width, tall = turned ? size.width : size.height;
    for (int y = low.y; y + tall - 1 <= high.y; ++y) {
      for (int x = low.x; x + wide - 1 <= high.x; ++x) {
        std::vector<cv::Point2f> corners;
        for (int k = 0; k < size.area(); ++k) {
          const int i = k % size.width, j = k / size.width;
          const auto found =
              places.find(turned ? std::pair{x + size.height - 1 - j, y + i} : std::pair{x + i, y + j});
          if (found == places.end()) break;
          corners.push_back(found->second);
        }
        if (std::ssize(corners) < size.area()) continue;
        // A square board has four ways: rows are as level as they can be.
        const cv::Point2f row = corners[static_cast<std::size_t>(size.width) - 1] - corners.front();
        const double roughness =
            grid_roughness(corners, size) + (std::abs(row.y) > std::abs(row.x) ? 1e-6 : 0);
        if (roughness >= least) continue;
        least = roughness;
        best = corners;
      }
    }
  }
  return best;
}

/// Where the others of its row and column say that a corner is.
struct Expected {
  cv::Point2f at;
  float spacing_px = 1e9F;  ///< to the nearest beside it
};
Expected expected(const std::vector<cv::Point2f>& p, cv::Size size, int i, int j) {
  Expected result;
  cv::Point2f sum(0, 0);
  float weights = 0;
  for (const bool down : {false, true}) {
    const int count = down ? size.height : size.width, at = down ? j : i, step = down ? size.width : 1,
              own = j * size.width + i;
    const auto q = [&](int d) { return p[static_cast<std::size_t>(own + d * step)]; };
    for (const int d : {-1, 1})
      if (at + d >= 0 && at + d < count)
        result.spacing_px = std::min(result.spacing_px, static_cast<float>(cv::norm(q(d) - q(0))));
    const auto add = [&](float weight, cv::Point2f place) {
      sum += weight * place;
      weights += weight;
    };
    const int before = at, after = count - 1 - at;  // polynomials through the neighbours
    if (before >= 2 && after >= 2)
      add(4, (4 * (q(-1) + q(1)) - q(-2) - q(2)) / 6);
    else if (before >= 1 && after >= 2)
      add(2, (q(-1) + 3 * q(1) - q(2)) / 3);
    else if (before >= 2 && after >= 1)
      add(2, (q(1) + 3 * q(-1) - q(-2)) / 3);
    else if (after >= 3)
      add(0.5F, 3 * q(1) - 3 * q(2) + q(3));
    else if (before >= 3)
      add(0.5F, 3 * q(-1) - 3 * q(-2) + q(-3));
  }
  result.at = weights > 0 ? sum / weights : p[static_cast<std::size_t>(j * size.width + i)];
  return result;
}

/// A wrong crossing beside the right one may have been nearer: the least expected corners are looked for
/// again.
void mend(const Saddles& s, cv::Size size, std::vector<cv::Point2f>& p) {
  constexpr int kMostRounds = 20;
  std::vector<int> tried(p.size(), 0);
  for (int round = 0; round < kMostRounds; ++round) {
    double worst = 0.12;  // of the spacing
    std::size_t at = p.size();
    Expected there;
    for (std::size_t k = 0; k < p.size(); ++k) {
      if (tried[k] > 1) continue;
      const Expected e =
          expected(p, size, static_cast<int>(k) % size.width, static_cast<int>(k) / size.width);
      const double off = cv::norm(e.at - p[k]) / static_cast<double>(std::max(e.spacing_px, 4.F));
      if (off <= worst) continue;
      worst = off;
      at = k;
      there = e;
    }
    if (at == p.size()) return;
    ++tried[at];
    p[at] = s.crossing_near(there.at, there.spacing_px).value_or(p[at]);
  }
}

std::vector<cv::Point2f> find_in(const cv::Mat& grey, cv::Size size) {
  if (std::min(grey.cols, grey.rows) <= 4 * kBorder_px) return {};
  const Saddles s(grey);
  std::vector<Crossing> all = find_crossings(s);
  const double least = kLeastGridPart * size.area();
  if (static_cast<double>(all.size()) < least) return {};
  join(s, all);
  std::vector<bool> is_taken(all.size());
  for (std::size_t first = 0; first < all.size(); ++first) {
    if (is_taken[first]) continue;
    Places places = places_from(all, first, is_taken);
    if (static_cast<double>(places.size()) < least) continue;
    fill(s, places);
    std::vector<cv::Point2f> corners = whole_board(places, size);
    if (corners.empty()) continue;
    mend(s, size, corners);
    if (grid_roughness(corners, size) <= kMostRoughness) return corners;
  }
  return {};
}

}  // namespace

double grid_roughness(const std::vector<cv::Point2f>& corners, cv::Size size) {
  double worst = 0;
  for (const bool down : {false, true}) {
    const int step = down ? size.width : 1;
    for (int k = 0; k < size.area(); ++k) {
      if ((down ? k / size.width + 4 > size.height : k % size.width + 4 > size.width)) continue;
      const auto p = [&](int d) { return corners[static_cast<std::size_t>(k + d * step)]; };
      const double spacing_px = std::max(cv::norm(p(3) - p(0)) / 3, 1e-3);
      worst = std::max(worst, cv::norm(p(0) - 3 * p(1) + 3 * p(2) - p(3)) / spacing_px);
    }
  }
  return worst;
}

void refine_board_grid(const cv::Mat& grey, cv::Size size, int window_px, float most_px,
                       std::vector<cv::Point2f>& corners) {
  const std::vector<cv::Point2f> found = corners;
  std::vector<cv::Point2f> one(1);
  for (std::size_t k = 0; k < found.size(); ++k) {
    const Expected e =
        expected(found, size, static_cast<int>(k) % size.width, static_cast<int>(k) / size.width);
    // The window stays within the squares around the corner; a smaller one where it drags the corner along.
    const int widest = window_px > 0 ? window_px : std::clamp(cvFloor(e.spacing_px / 2 - 1), 2, 11);
    for (int half = widest; half >= 2; half = half * 2 / 3) {
      one[0] = found[k];
      cv::cornerSubPix(grey, one, {half, half}, {-1, -1},
                       cv::TermCriteria(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 50, 0.001));
      // One that was asked for moves corners as it may.
      if (window_px == 0 && cv::norm(one[0] - found[k]) > static_cast<double>(most_px)) continue;
      corners[k] = one[0];
      break;
    }
  }
}

std::vector<cv::Point2f> find_board_grid(const cv::Mat& grey, cv::Size size, int window_px) {
  // As it is; finer, for squares of few pixels; coarser, for blurred ones.
  constexpr int kLargest_px = 1400, kSmallest_px = 500;
  for (const double scale : {1.0, 2.0, 0.5}) {
    const int side_px = std::max(grey.cols, grey.rows);
    if ((scale > 1 && side_px > kLargest_px) || (scale < 1 && side_px < kSmallest_px)) continue;
    cv::Mat scaled = grey;
    if (scale != 1) cv::resize(grey, scaled, {}, scale, scale, scale > 1 ? cv::INTER_CUBIC : cv::INTER_AREA);
    std::vector<cv::Point2f> corners = find_in(scaled, size);
    if (corners.empty()) continue;
    // Pixel centres are whole numbers.
    for (cv::Point2f& p : corners) {
      const auto back = [&](float x) {
        return static_cast<float>((static_cast<double>(x) + 0.5) / scale - 0.5);
      };
      p = {back(p.x), back(p.y)};
    }
    refine_board_grid(grey, size, window_px, static_cast<float>(1.5 / std::min(scale, 1.0)), corners);
    return corners;
  }
  return {};
}

}  // namespace tactus

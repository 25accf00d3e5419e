#include "tactus/cli/output/chart.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/base/vec.h"
#include "tactus/cli/output/sheet_colors.h"
#include "tactus/view/image_files.h"

namespace tactus {
namespace {

constexpr Index kChartWidth_px = 1200, kChartHeight_px = 800;
constexpr Index kLeft_px = 110, kRight_px = 70, kTop_px = 90, kBottom_px = 90;
constexpr Rgb8 kGrid{222, 224, 227};

void blend(ColorImage& image, Index x, Index y, Rgb8 color, float share) {
  if (x < 0 || y < 0 || x >= image.width_px || y >= image.height_px) return;
  const auto mix = [&](std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(static_cast<float>(a) * (1 - share) + static_cast<float>(b) * share +
                                     0.5F);
  };
  Rgb8& p = image(x, y);
  p = {mix(p.r, color.r), mix(p.g, color.g), mix(p.b, color.b)};
}

/// A pixel is covered as far as its middle is within the line's half width.
void draw_segment(ColorImage& image, Vec2d a, Vec2d b, double width_px, Rgb8 color) {
  const double reach = 0.5 * width_px + 1,
               all = std::max((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y), 1e-12);
  const auto low = [&](double p, double q) { return static_cast<Index>(std::floor(std::min(p, q) - reach)); };
  const auto high = [&](double p, double q) { return static_cast<Index>(std::ceil(std::max(p, q) + reach)); };
  for (Index y = low(a.y, b.y); y <= high(a.y, b.y); ++y) {
    for (Index x = low(a.x, b.x); x <= high(a.x, b.x); ++x) {
      const double t = std::clamp(((x - a.x) * (b.x - a.x) + (y - a.y) * (b.y - a.y)) / all, 0.0, 1.0);
      const double off = std::hypot(x - a.x - t * (b.x - a.x), y - a.y - t * (b.y - a.y));
      const double share = std::clamp(0.5 * width_px + 0.5 - off, 0.0, 1.0);
      if (share > 0) blend(image, x, y, color, static_cast<float>(share));
    }
  }
}

/// Bounds of an axis: whole powers of ten that enclose the values.
struct ChartAxis {
  double low, high;  ///< log10
  double at(double value) const { return (std::log10(value) - low) / (high - low); }
};

template <class Get>
ChartAxis axis_of(const Chart& chart, Get get) {
  double least = 1e300, most = 0;
  for (const ChartSeries& s : chart.series) {
    for (const auto& p : s.points) {
      const double value = get(p);
      if (!(value > 0 && value < 1e300))
        throw Error("chart: " + number_text(value) + ", expected a number > 0");
      least = std::min(least, value), most = std::max(most, value);
    }
  }
  if (!(most > 0)) throw Error("chart: there is nothing to draw");
  const double low = std::floor(std::log10(least) + 1e-9), high = std::ceil(std::log10(most) - 1e-9);
  return {low, std::max(high, low + 1)};
}

std::string power_text(double log10_value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", std::pow(10.0, log10_value));
  return text;
}

}  // namespace

ColorImage draw_chart(const Chart& chart) {
  const ChartAxis x_axis = axis_of(chart, [](const auto&p) { return p.first; }),
                  y_axis = axis_of(chart, [](const auto&p) { return p.second; });
  const double wide = kChartWidth_px - kLeft_px - kRight_px, tall = kChartHeight_px - kTop_px - kBottom_px;
  const auto place = [&](double x, double y) {
    return Vec2d{kLeft_px + wide * x_axis.at(x), kChartHeight_px - kBottom_px - tall * y_axis.at(y)};
  };
  ColorImage image(kChartWidth_px, kChartHeight_px);
  std::fill(image.pixels.begin(), image.pixels.end(), Rgb8{250, 250, 248});
  for (const bool is_x : {true, false}) {
    const ChartAxis& axis = is_x ? x_axis : y_axis;
    for (double power = axis.low; power <= axis.high + 1e-9; ++power) {
      const double value = std::pow(10.0, power);
      const Vec2d from = is_x ? place(value, std::pow(10.0, y_axis.low))
                              : place(std::pow(10.0, x_axis.low), value),
                  to = is_x ? place(value, std::pow(10.0, y_axis.high))
                            : place(std::pow(10.0, x_axis.high), value);
      draw_segment(image, from, to, 1.2, kGrid);
      const std::string text = power_text(power);
      const Index shift = static_cast<Index>(text.size()) * 5;
      draw_text(image, text, static_cast<Index>(from.x) - (is_x ? shift : 2 * shift + 14),
                static_cast<Index>(from.y) + (is_x ? 26 : 6), 15, kInk);
    }
  }
  draw_text(image, chart.title, kLeft_px, 38, 24, kInk);
  draw_text(image, chart.remark, kLeft_px, 66, 14, kFaint);
  draw_text(image, chart.x_name, kLeft_px + static_cast<Index>(wide) / 2 - 60, kChartHeight_px - 24, 16,
            kFaint);
  draw_text(image, chart.y_name, 20, kTop_px - 12 < 80 ? kTop_px - 2 : kTop_px - 12, 16, kFaint);
  Index legend_y = kTop_px + 34;
  for (const ChartSeries& s : chart.series) {
    for (std::size_t k = 0; k < s.points.size(); ++k) {
      const Vec2d at = place(s.points[k].first, s.points[k].second);
      if (k > 0) draw_segment(image, place(s.points[k - 1].first, s.points[k - 1].second), at, 3, s.color);
      draw_segment(image, at, at, 11, s.color);
    }
    const double y = legend_y - 6;
    draw_segment(image, {kLeft_px + 24.0, y}, {kLeft_px + 64.0, y}, 3, s.color);
    draw_segment(image, {kLeft_px + 44.0, y}, {kLeft_px + 44.0, y}, 11, s.color);
    draw_text(image, s.name, kLeft_px + 80, legend_y, 17, kInk);
    legend_y += 32;
  }
  return image;
}

}  // namespace tactus

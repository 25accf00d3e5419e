#pragma once
/// A chart of measurements over sizes.
#include <string>
#include <utility>
#include <vector>

#include "tactus/geom/image/image.h"

namespace tactus {

struct ChartSeries {
  std::string name;
  Rgb8 color;
  std::vector<std::pair<double, double>> points;  ///< both > 0, by ascending size
};

struct Chart {
  std::string title, remark, x_name, y_name;
  std::vector<ChartSeries> series;
};

/// With logarithmic axes, 1200 x 800 pixels. @throws Error without a point, or for one that is not positive.
ColorImage draw_chart(const Chart& chart);

}  // namespace tactus

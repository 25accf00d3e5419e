#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "tactus/base/error.h"
#include "tactus/view/image_files.h"

namespace tactus {
namespace {

constexpr Index kMarginPx = 12, kTitlePx = 44, kCaptionPx = 28;
constexpr Rgb8 kPaper{250, 250, 248}, kInk{40, 44, 52};

ColorImage scaled_to_width(const ColorImage& image, Index width_px) {
  const Index height_px = std::max<Index>(
      1, static_cast<Index>(static_cast<std::int64_t>(image.height_px) * width_px / image.width_px));
  ColorImage out(width_px, height_px);
  const cv::Mat from(image.height_px, image.width_px, CV_8UC3, const_cast<Rgb8*>(image.pixels.data()));
  cv::Mat to(height_px, width_px, CV_8UC3, out.pixels.data());
  cv::resize(from, to, to.size(), 0, 0, cv::INTER_AREA);
  return out;
}

}  // namespace

ContactSheet::ContactSheet(std::string title, Index cells, Index columns, Index cell_width_px)
    : title_(std::move(title)), cells_(cells), columns_(columns), cell_width_px_(cell_width_px) {
  if (cells <= 0 || columns <= 0 || cell_width_px <= 0) {
    throw Error("contact sheet: " + std::to_string(cells) + " cells in " + std::to_string(columns) +
                " columns of " + std::to_string(cell_width_px) + " px, expected positive numbers");
  }
}

void ContactSheet::add(const ColorImage& frame, const std::string& caption) {
  if (frame.empty()) throw Error("contact sheet: an empty frame");
  last_ = {scaled_to_width(frame, cell_width_px_), caption};
  if (seen_++ % stride_ != 0) return;
  kept_.push_back(last_);
  if (static_cast<Index>(kept_.size()) < 2 * cells_ + 1) return;
  for (std::size_t i = 0; 2 * i < kept_.size(); ++i) {
    if (i > 0) kept_[i] = std::move(kept_[2 * i]);
  }
  kept_.resize((kept_.size() + 1) / 2);
  stride_ *= 2;
}

ColorImage ContactSheet::image() const {
  if (kept_.empty()) throw Error("contact sheet: no frame was added");
  // Evenly among those kept, the very first and the very last included.
  std::vector<const Cell*> candidates;
  for (const Cell& cell : kept_) candidates.push_back(&cell);
  if ((seen_ - 1) % stride_ != 0) candidates.push_back(&last_);
  const Index count = std::min(cells_, static_cast<Index>(candidates.size()));
  std::vector<const Cell*> chosen;
  const auto last = static_cast<Index>(candidates.size()) - 1;
  for (Index i = 0; i < count; ++i)
    chosen.push_back(candidates[static_cast<std::size_t>(
        count == 1 ? 0 : (2 * i * last + count - 1) / (2 * (count - 1)))]);

  Index cell_height_px = 0;
  for (const Cell* cell : chosen) cell_height_px = std::max(cell_height_px, cell->picture.height_px);
  const Index columns = std::min(columns_, count), rows = (count + columns - 1) / columns;
  ColorImage sheet(kMarginPx + columns * (cell_width_px_ + kMarginPx),
                   kTitlePx + rows * (cell_height_px + kCaptionPx + kMarginPx), kPaper);
  draw_text(sheet, title_, kMarginPx, kTitlePx - 14, 18, kInk);
  for (Index i = 0; i < count; ++i) {
    const Cell& cell = *chosen[static_cast<std::size_t>(i)];
    const Index x0 = kMarginPx + (i % columns) * (cell_width_px_ + kMarginPx);
    const Index y0 = kTitlePx + (i / columns) * (cell_height_px + kCaptionPx + kMarginPx);
    for (Index y = 0; y < cell.picture.height_px; ++y)
      std::copy_n(&cell.picture(0, y), cell_width_px_, &sheet(x0, y0 + y));
    draw_text(sheet, cell.caption, x0 + 2, y0 + cell_height_px + 19, 12, kInk);
  }
  return sheet;
}

}  // namespace tactus

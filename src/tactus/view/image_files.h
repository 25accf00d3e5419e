#pragma once
/// Pictures and videos on disk. Files are whole or not there (base/safe_file.h).
#include <memory>
#include <string>
#include <vector>

#include "tactus/geom/image/image.h"

namespace tactus {

/// Writes an 8-bit sRGB PNG. @throws Error naming the path and the reason.
void write_png(const std::string& path, const ColorImage& image);

/// The same in memory. @throws Error when the image is empty.
std::vector<std::uint8_t> encode_png(const ColorImage& image);

/// A line along the lower border, as high as asked for, or lower where it would not fit between the margins.
void draw_line_of_text(ColorImage& image, const std::string& text, Index margin_px, float height_px);

/// Text on a picture, its lower left corner at (x_px, y_px): light with a dark rim, so that it reads on
/// anything.
void draw_text(ColorImage& image, const std::string& text, Index x_px, Index y_px, float height_px = 16,
               Rgb8 color = {255, 255, 255});

/// How wide draw_text makes it.
Index text_width_px(const std::string& text, float height_px);

/// The same, but lower where it would be wider than `most_px`.
void draw_text_within(ColorImage& image, const std::string& text, Index x_px, Index y_px, float height_px,
                      Index most_px, Rgb8 color);

/// An MP4 of H.264. Frames go to a temporary file.
class VideoWriter {
 public:
  /// @throws Error when the path can't be written or doesn't end in ".mp4", the sides are not even and
  /// positive, or fps isn't within 1 to 240.
  VideoWriter(const std::string& path, Index width_px, Index height_px, double fps);
  /// Finishes, too, so that an interrupted program leaves a video that plays; errors are logged.
  ~VideoWriter();
  VideoWriter(VideoWriter&&) noexcept;
  VideoWriter& operator=(VideoWriter&&) = delete;

  /// @throws Error when the size differs from the video's, or after finish().
  void add(const ColorImage& frame);
  /// Closes the file, sees that it is whole and gives it its name; without a frame nothing is left.
  /// @throws Error naming the path, when the disk was full for example.
  void finish();
  int frame_count() const;
  /// "avc1".
  const std::string& codec() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Up to `cells` frames, evenly chosen from a run of known or unknown length, in one picture.
class ContactSheet {
 public:
  /// `cell_width_px`: frames are scaled to it. @throws Error for cells, columns or a width that aren't
  /// positive.
  explicit ContactSheet(std::string title, Index cells = 12, Index columns = 4, Index cell_width_px = 480);
  /// Takes every k-th frame; k doubles whenever twice `cells` are kept, so memory stays bounded.
  void add(const ColorImage& frame, const std::string& caption);
  /// The sheet: a title, then rows of cells with a line of text under each. @throws Error without a frame.
  ColorImage image() const;

 private:
  struct Cell {
    ColorImage picture;
    std::string caption;
  };
  std::string title_;
  Index cells_, columns_, cell_width_px_;
  std::int64_t seen_ = 0, stride_ = 1;
  std::vector<Cell> kept_;
  Cell last_;
};

}  // namespace tactus

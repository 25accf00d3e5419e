#pragma once
/// Films, streams and cameras of the operating system, by FFmpeg's libraries. These are loaded when the first
/// film is opened, so the program starts without them.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace tactus {

struct FilmFrame {
  int width_px = 0, height_px = 0;
  std::vector<std::uint8_t> bgr;  ///< blue, green, red; rows without padding, from the top
  double time_s = 0;              ///< since the film's first frame, by its time stamps
};

class FilmReader {
 public:
  /// Size and rate that a camera is asked for.
  struct Device {
    int width_px = 0, height_px = 0;
    double fps = 30;
  };
  /// @throws Error with the reason (without the name): not a film, or FFmpeg is missing.
  explicit FilmReader(const std::string& file);
  /// A stream: a URL with "://".
  static FilmReader stream(const std::string& url);
  /// A camera: "/dev/video0".
  static FilmReader device(const std::string& path, const Device& wanted);
  ~FilmReader();
  FilmReader(FilmReader&&) noexcept;
  FilmReader& operator=(FilmReader&&) noexcept;

  int width_px() const;
  int height_px() const;
  /// Mean, by the header's frames and their times; 0 where that says nothing.
  double fps() const;
  /// By the header, which may promise more than a damaged file holds; 0 where it says nothing.
  int frame_count() const;
  /// The next frame, upright. @returns false at the end, and where the rest can't be decoded.
  bool read(FilmFrame& frame);
  /// Goes past a frame without making its picture.
  bool skip();
  /// The picture of the frame that was read or skipped last. @returns false when it can't be made.
  bool picture(FilmFrame& frame);
  /// Time of the last frame that was read or skipped [s], from that of the first.
  double time_s() const;

 private:
  struct State;
  explicit FilmReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// "" or the missing library and its consequence: "...: no films are read".
std::string films_missing();

}  // namespace tactus

#pragma once
/// An MP4 of one H.264 stream (ISO 14496-12 and -15): the frames first, their index at the end.
#include <cstdint>
#include <string>
#include <vector>

#include "tactus/media/h264_encoder.h"

namespace tactus {

class Mp4Muxer {
 public:
  /// @param fd an empty file; stays the caller's
  Mp4Muxer(int fd, int width_px, int height_px, double fps);
  /// @throws Error when the file can't be written.
  void add(const H264Frame& frame);
  /// Writes the index. @throws as `add`.
  void finish();

 private:
  std::string media_boxes() const;
  std::string sample_boxes() const;
  void write(std::uint64_t at, const void* bytes, std::size_t size) const;
  int fd_, width_px_, height_px_;
  std::uint32_t ticks_per_s_;
  std::uint64_t end_ = 0, frames_at_ = 0;
  std::vector<std::uint32_t> sizes_, keys_;  ///< keys: numbers of frames, from 1
  std::vector<std::uint8_t> sps_, pps_;
};

}  // namespace tactus

#pragma once
/// H.264 by OpenH264.
#include <cstdint>
#include <memory>
#include <vector>

namespace tactus {

struct H264Frame {
  std::vector<std::uint8_t> units;     ///< NAL units, each behind its length (4 bytes, big endian)
  std::vector<std::uint8_t> sps, pps;  ///< of a key frame: parameters of the stream, not among the units
  bool is_key = false;
};

class H264Encoder {
 public:
  /// @param width_px, height_px even @throws Error when the encoder doesn't take the size.
  H264Encoder(int width_px, int height_px, double fps);
  ~H264Encoder();
  H264Encoder(const H264Encoder&) = delete;
  H264Encoder& operator=(const H264Encoder&) = delete;
  /// @param i420 a plane of brightness, then two of colour with half the sides @throws Error when it fails.
  H264Frame encode(const std::uint8_t* i420, std::int64_t time_ms);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tactus

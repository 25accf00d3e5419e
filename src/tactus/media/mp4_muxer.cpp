#include "tactus/media/mp4_muxer.h"

#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <string_view>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr std::uint32_t kTicksPerFrame = 1000;

std::string number(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> 8 * i & 255U);
  return text;
}
std::string u16(std::uint64_t v) { return number(v, 2); }
std::string u32(std::uint64_t v) { return number(v, 4); }
std::string u64(std::uint64_t v) { return number(v, 8); }
std::string zeros(std::size_t count) { return std::string(count, '\0'); }
std::string box(std::string_view kind, const std::string& body) {
  return u32(body.size() + 8) + std::string(kind) + body;
}
/// With a version and flags.
std::string full_box(std::string_view kind, const std::string& body, std::uint32_t flags = 0,
                     std::uint64_t version = 0) {
  return box(kind, u32(version << 24 | flags) + body);
}
std::string unit_matrix() { return u32(0x10000) + zeros(12) + u32(0x10000) + zeros(12) + u32(0x40000000); }
std::string text_of(const std::vector<std::uint8_t>& bytes) { return {bytes.begin(), bytes.end()}; }

}  // namespace

Mp4Muxer::Mp4Muxer(int fd, int width_px, int height_px, double fps)
    : fd_(fd),
      width_px_(width_px),
      height_px_(height_px),
      ticks_per_s_(static_cast<std::uint32_t>(std::lround(fps * kTicksPerFrame))) {}

void Mp4Muxer::write(std::uint64_t at, const void* bytes, std::size_t size) const {
  const auto* from = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t written = ::pwrite(fd_, from, size, static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throw Error(std::strerror(errno));
    from += written;
    at += static_cast<std::uint64_t>(written);
    size -= static_cast<std::size_t>(written);
  }
}

void Mp4Muxer::add(const H264Frame& frame) {
  if (sizes_.empty()) {
    // The length of 'mdat' is written at the end; until then the file is known to be cut short.
    const std::string head = box("ftyp", "isom" + u32(512) + "isomiso2avc1mp41") + u32(1) + "mdat" + u64(0);
    write(0, head.data(), head.size());
    end_ = frames_at_ = head.size();
  }
  write(end_, frame.units.data(), frame.units.size());
  end_ += frame.units.size();
  sizes_.push_back(static_cast<std::uint32_t>(frame.units.size()));
  if (frame.is_key) keys_.push_back(static_cast<std::uint32_t>(sizes_.size()));
  if (!frame.sps.empty()) sps_ = frame.sps;
  if (!frame.pps.empty()) pps_ = frame.pps;
}

/// Describes the samples: their coding, times, sizes and place.
std::string Mp4Muxer::sample_boxes() const {
  std::string avcc = number(1, 1);
  avcc += text_of(sps_).substr(1, 3);  // profile, compatibility, level
  avcc += number(0xFF, 1) + number(0xE1, 1) + u16(sps_.size()) + text_of(sps_) + number(1, 1) +
          u16(pps_.size()) + text_of(pps_);
  const std::string entry =
      box("avc1", zeros(6) + u16(1) + zeros(16) + u16(static_cast<unsigned>(width_px_)) +
                      u16(static_cast<unsigned>(height_px_)) + u32(0x480000) + u32(0x480000) + zeros(4) +
                      u16(1) + zeros(32) + u16(24) + u16(0xFFFF) + box("avcC", avcc));
  std::string sizes = u32(0) + u32(sizes_.size()), keys = u32(keys_.size());
  for (const std::uint32_t size : sizes_) sizes += u32(size);
  for (const std::uint32_t key : keys_) keys += u32(key);
  return full_box("stsd", u32(1) + entry) +
         full_box("stts", u32(1) + u32(sizes_.size()) + u32(kTicksPerFrame)) + full_box("stss", keys) +
         full_box("stsc", u32(1) + u32(1) + u32(sizes_.size()) + u32(1)) + full_box("stsz", sizes) +
         full_box("co64", u32(1) + u64(frames_at_));
}

std::string Mp4Muxer::media_boxes() const {
  const std::uint64_t length = sizes_.size() * std::uint64_t{kTicksPerFrame};
  const std::string data = box("dinf", full_box("dref", u32(1) + full_box("url ", "", 1)));
  const std::string media =
      full_box("mdhd", u64(0) + u64(0) + u32(ticks_per_s_) + u64(length) + u16(0x55C4) + u16(0), 0, 1) +
      full_box("hdlr", u32(0) + "vide" + zeros(12) + "video" + zeros(1)) +
      box("minf", full_box("vmhd", zeros(8), 1) + data + box("stbl", sample_boxes()));
  const std::string track = full_box("tkhd",
                                     u64(0) + u64(0) + u32(1) + u32(0) + u64(length) + zeros(16) +
                                         unit_matrix() + u32(static_cast<std::uint64_t>(width_px_) << 16) +
                                         u32(static_cast<std::uint64_t>(height_px_) << 16),
                                     3, 1);
  const std::string movie = full_box("mvhd",
                                     u64(0) + u64(0) + u32(ticks_per_s_) + u64(length) + u32(0x10000) +
                                         u16(0x100) + zeros(10) + unit_matrix() + zeros(24) + u32(2),
                                     0, 1);
  return movie + box("trak", track + box("mdia", media));
}

void Mp4Muxer::finish() {
  if (sizes_.empty()) return;
  if (sps_.size() < 4) throw Error("the encoder gave no parameters");
  const std::string index = box("moov", media_boxes());
  write(end_, index.data(), index.size());
  const std::string length = u64(end_ - frames_at_ + 16);
  write(frames_at_ - 8, length.data(), length.size());
}

}  // namespace tactus

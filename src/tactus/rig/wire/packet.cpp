#include "tactus/rig/wire/packet.h"

#include <cmath>

namespace tactus {
namespace {

constexpr std::uint32_t kMagic = 0x50544354;  // "TCTP"
constexpr std::uint16_t kPacketVersion = 1;
constexpr Index kWidest_px = 32768;

void put_name(const std::string& name, std::string& to) {
  to += std::string_view(name).substr(0, PacketHead::kMostNameBytes);
  to.append(PacketHead::kMostNameBytes + 1 - std::min(name.size(), PacketHead::kMostNameBytes), '\0');
}

/// Up to the first zero; only zeros may follow.
std::string take_name(ByteReader& from) {
  const std::string_view field = from.take(PacketHead::kMostNameBytes + 1);
  const std::size_t end = field.find('\0');
  if (end == field.npos || end == 0 || field.find_first_not_of('\0', end) != field.npos) from.fail();
  return from.failed() ? std::string() : std::string(field.substr(0, end));
}

bool is_size(Vec2i size_px) {
  return size_px.x > 0 && size_px.x <= kWidest_px && size_px.y > 0 && size_px.y <= kWidest_px &&
         static_cast<std::uint64_t>(size_px.x) * static_cast<std::uint64_t>(size_px.y) <= kMostImagePixels;
}

bool lies_in(const PixelBox& box, Vec2i size_px) {
  return box.left_px >= 0 && box.top_px >= 0 && box.width_px > 0 && box.height_px > 0 &&
         box.left_px <= size_px.x - box.width_px && box.top_px <= size_px.y - box.height_px;
}

/// A silhouette with or without soft edge and photograph, or distances.
bool are_contents(std::uint8_t contents) {
  return contents == PacketHead::kDepth ||
         ((contents & PacketHead::kMask) != 0 && contents < 16 && (contents & PacketHead::kDepth) == 0);
}

}  // namespace

const char* refusal_text(Refusal refusal) {
  static constexpr const char* kTexts[] = {
      "none",           "too short",    "too long",    "not a packet", "version",  "head",
      "no such camera", "other camera", "calibration", "old boot",     "repeated", "too many",
      "too much",       "late",         "ahead",       "payload",      "clock",    "other client"};
  static_assert(std::size(kTexts) == static_cast<std::size_t>(Refusal::count));
  return kTexts[static_cast<std::size_t>(refusal)];
}

std::uint64_t calibration_hash(const Camera& pinhole) { return calibration_hash(pinhole, Lens{}); }

std::uint64_t calibration_hash(const Camera& pinhole, const Lens& lens) {
  std::string bytes;
  put_bytes(bytes, pinhole.width_px);
  put_bytes(bytes, pinhole.height_px);
  for (const double v : {pinhole.fx_px, pinhole.fy_px, pinhole.cx_px, pinhole.cy_px, pinhole.skew_px})
    put_bytes(bytes, v);
  put_bytes(bytes, lens.model);
  for (const double k : lens.k) put_bytes(bytes, k);
  return fnv1a(bytes);
}

std::size_t packet_limit(Vec2i size_px) {
  constexpr std::size_t kHeads = 64;  // of three images
  const auto pixels = static_cast<std::size_t>(size_px.x) * static_cast<std::size_t>(size_px.y);
  const std::size_t mask =
      (static_cast<std::size_t>(size_px.x) + 31) / 32 * 4 * static_cast<std::size_t>(size_px.y);
  // A soft edge and a photograph that does not get smaller, or distances.
  return PacketHead::kBytes + kHeads + mask + 4 * pixels;
}

Refusal parse_packet_head(std::string_view packet, PacketHead& head) {
  ByteReader in(packet.substr(0, PacketHead::kBytes));
  const auto magic = in.take<std::uint32_t>();
  const auto version = in.take<std::uint16_t>(), head_bytes = in.take<std::uint16_t>();
  if (packet.size() >= sizeof magic && magic != kMagic) return Refusal::not_a_packet;
  if (packet.size() < PacketHead::kBytes) return Refusal::too_short;
  if (version != kPacketVersion || head_bytes != PacketHead::kBytes) return Refusal::version;
  head.contents = in.take<std::uint8_t>();
  head.copies = in.take<std::uint8_t>();
  in.take(2);
  head.payload_bytes = in.take<std::uint32_t>();
  head.camera = take_name(in);
  head.calibration = in.take<std::uint64_t>();
  head.boot = in.take<std::uint64_t>();
  head.sequence = in.take<std::uint64_t>();
  head.trigger = in.take<std::int64_t>();
  head.captured_s = in.take<double>();
  head.sent_s = in.take<double>();
  head.size_px.x = in.take<std::int32_t>();
  head.size_px.y = in.take<std::int32_t>();
  for (Index* v :
       {&head.photo_box.left_px, &head.photo_box.top_px, &head.photo_box.width_px, &head.photo_box.height_px})
    *v = in.take<std::uint16_t>();
  head.replaced = in.take<std::uint32_t>();
  const std::size_t payload = packet.size() - PacketHead::kBytes;
  if (payload < head.payload_bytes) return Refusal::too_short;
  if (payload > head.payload_bytes) return Refusal::too_long;
  const bool has_photo = (head.contents & PacketHead::kPhoto) != 0;
  const bool ok = !in.failed() && are_contents(head.contents) && is_size(head.size_px) &&
                  std::abs(head.captured_s) <= PacketHead::kMostTime_s &&
                  std::abs(head.sent_s) <= PacketHead::kMostTime_s &&
                  head.trigger >= PacketHead::kNoTrigger && head.trigger <= PacketHead::kMostTrigger &&
                  (has_photo ? lies_in(head.photo_box, head.size_px) : head.photo_box == PixelBox{});
  return ok ? Refusal::none : Refusal::head;
}

void PacketCoder::pack(PacketHead& head, const CameraImages& images, std::string& to) {
  const bool is_depth = !images.depth_m.empty(), has_alpha = !is_depth && !images.alpha.empty(),
             has_photo = !is_depth && !images.photo_jpeg.empty();
  int contents = PacketHead::kMask;
  if (is_depth) contents = PacketHead::kDepth;
  if (has_alpha) contents |= PacketHead::kAlpha;
  if (has_photo) contents |= PacketHead::kPhoto;
  head.contents = static_cast<std::uint8_t>(contents);
  head.size_px = is_depth ? Vec2i{images.depth_m.width_px, images.depth_m.height_px}
                          : Vec2i{images.mask.width_px, images.mask.height_px};
  head.photo_box = has_photo ? images.photo_box : PixelBox{};
  to.clear();
  put_bytes(to, kMagic);
  put_bytes(to, kPacketVersion);
  put_bytes(to, static_cast<std::uint16_t>(PacketHead::kBytes));
  put_bytes(to, head.contents);
  put_bytes(to, head.copies);
  to.append(2, '\0');
  const std::size_t length_at = to.size();
  put_bytes(to, std::uint32_t{0});
  put_name(head.camera, to);
  put_bytes(to, head.calibration);
  put_bytes(to, head.boot);
  put_bytes(to, head.sequence);
  put_bytes(to, head.trigger);
  put_bytes(to, head.captured_s);
  put_bytes(to, head.sent_s);
  put_bytes(to, static_cast<std::int32_t>(head.size_px.x));
  put_bytes(to, static_cast<std::int32_t>(head.size_px.y));
  for (const Index v :
       {head.photo_box.left_px, head.photo_box.top_px, head.photo_box.width_px, head.photo_box.height_px})
    put_bytes(to, static_cast<std::uint16_t>(v));
  put_bytes(to, head.replaced);
  to.resize(PacketHead::kBytes);
  if (is_depth) coder_.put(images.depth_m, to);
  if (!is_depth) coder_.put(images.mask, to);
  if (has_alpha) coder_.put(images.alpha, to);
  if (has_photo) to += images.photo_jpeg;
  head.payload_bytes = static_cast<std::uint32_t>(to.size() - PacketHead::kBytes);
  set_bytes(to, length_at, head.payload_bytes);
}

bool PacketCoder::unpack(std::string_view packet, const PacketHead& head, CameraImages& images) {
  ByteReader in(packet.substr(PacketHead::kBytes));
  const auto has = [&](PacketHead::Contents what) { return (head.contents & what) != 0; };
  images.photo_box = head.photo_box;
  images.photo_jpeg.clear();
  images.alpha = {};
  if (has(PacketHead::kDepth))
    return coder_.take(in, head.size_px, images.depth_m) && !images.depth_m.empty() && in.left() == 0;
  if (!coder_.take(in, head.size_px, images.mask) || images.mask.words.empty()) return false;
  if (has(PacketHead::kAlpha) && (!coder_.take(in, head.size_px, images.alpha) || images.alpha.empty()))
    return false;
  if (has(PacketHead::kPhoto)) images.photo_jpeg = in.take(in.left());
  return in.left() == 0 && has(PacketHead::kPhoto) == !images.photo_jpeg.empty();
}

}  // namespace tactus

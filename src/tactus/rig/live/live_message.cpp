#include "tactus/rig/live/live_message.h"

#include "tactus/base/byte_io.h"

namespace tactus {
namespace {

constexpr std::uint32_t kMagic = 0x4d544354;  // "TCTM"
constexpr std::size_t kBytes = 56, kNameBytes = 32;
constexpr std::uint32_t kMessageVersion = 1;

}  // namespace

std::string live_message_bytes(const LiveMessage& message) {
  std::string bytes;
  put_bytes(bytes, kMagic);
  put_bytes(bytes, kMessageVersion);
  put_bytes(bytes, message.kind);
  put_bytes(bytes, message.detail);
  put_bytes(bytes, message.number);
  bytes += std::string_view(message.camera).substr(0, kNameBytes - 1);
  bytes.resize(kBytes);
  return bytes;
}

std::optional<LiveMessage> parse_live_message(std::string_view bytes) {
  ByteReader in(bytes);
  const auto magic = in.take<std::uint32_t>(), version = in.take<std::uint32_t>();
  LiveMessage message;
  const auto kind = in.take<std::uint32_t>();
  message.kind = static_cast<LiveMessage::Kind>(kind);
  message.detail = in.take<std::uint32_t>();
  message.number = in.take<std::uint64_t>();
  const std::string_view name = in.take(kNameBytes);
  if (in.failed() || in.left() > 0 || magic != kMagic || version != kMessageVersion) return {};
  if (kind < LiveMessage::kHello || kind > LiveMessage::kTrigger) return {};
  message.camera = name.substr(0, std::min(name.find('\0'), kNameBytes));
  return message;
}

}  // namespace tactus

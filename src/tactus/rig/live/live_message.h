#pragma once
/// The small messages between client and server, beside packets of images. docs/wire.md has the format.
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tactus {

struct LiveMessage {
  enum Kind : std::uint32_t {
    kHello = 1,    ///< of a client: it is there; `number` is its boot
    kAsk = 2,      ///< of a client with the status key
    kReceipt = 3,  ///< of the server, for each packet: `number` is its sequence, `detail` a Refusal
    kTrigger = 4,  ///< of the server: `number` is the tick
  };
  Kind kind = kHello;
  std::uint32_t detail = 0;
  std::uint64_t number = 0;
  std::string camera;  ///< of a hello
};

std::string live_message_bytes(const LiveMessage& message);
/// None for other bytes.
std::optional<LiveMessage> parse_live_message(std::string_view bytes);

}  // namespace tactus

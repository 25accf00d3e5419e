#pragma once
/// The computer of a camera: sends its newest images.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/live/rig_server.h"

namespace tactus {

/// Sends on a thread of its own, and connects again when the connection breaks. Images wait in a mailbox of
/// one place: newer ones replace them, so an image that arrives is never old because the network is slow. At
/// most two packets of a connection are on the way without a receipt. When packets are late, it makes more
/// connections and sends each packet over two (CopyRule).
class RigClient {
 public:
  static constexpr int kConnections = 4;
  struct Status {
    bool is_heard = false;  ///< a receipt came in the last second
    std::int64_t sent = 0, taken = 0, replaced = 0;
    std::int64_t copies = 0;  ///< sent over a second connection
    RefusalCounts refused{};
  };
  /// @param key none: plain, to this computer alone. @throws usage Error for plain to another one, and for a
  /// key that is not this camera's.
  RigClient(const LiveCamera& camera, const std::string& address, const std::optional<LiveKey>& key,
            int most_connections = kConnections);
  ~RigClient();
  RigClient(const RigClient&) = delete;
  RigClient& operator=(const RigClient&) = delete;

  /// Newest wins. `images` gets the memory of older ones. @param captured_s on the clock of now_s()
  void put(CameraImages& images, std::int64_t trigger, double captured_s);
  /// Number of the server's next trigger; none by `until_s`. Triggers that nobody waited for are forgotten
  /// but for the newest.
  std::optional<std::int64_t> wait_trigger(double until_s);
  Status status() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Asks a server how it goes. @param key the status key; none: plain
/// @returns the JSON of live_status_json; none when nobody answered.
std::optional<std::string> ask_live_status(const std::string& address, const std::optional<LiveKey>& key,
                                           double seconds);

}  // namespace tactus

#pragma once
/// The computer that reconstructs: takes packets of cameras in, gives sets out.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/live_settings.h"
#include "tactus/rig/wire/packet.h"

namespace tactus {

/// A camera that a server expects.
struct LiveCamera {
  std::string name;
  Vec2i size_px;                  ///< of its undistorted images
  std::uint64_t calibration = 0;  ///< calibration_hash
  bool is_depth = false;
};

/// A set as it was released.
struct LiveSet {
  std::int64_t tick = 0;
  double captured_s = 0;  ///< on the clock of now_s()
  double released_s = 0;
  bool is_complete = false;
  std::vector<CameraImages> images;  ///< one per camera
  std::vector<bool> is_in;           ///< likewise; false: it missed the tick
};

struct LiveCameraStatus {
  std::string name;
  bool is_present = false;
  double packets_per_s = 0, bytes_per_s = 0;  ///< over the last second
  double skew_ms = 0;                         ///< newest capture behind that of its set's first camera
  double drift_ppm = 0;                       ///< of its clock
  double coverage = 0;  ///< share of the newest mask's, or distances', pixels that are set
  std::int64_t packets = 0, in_sets = 0;
  std::int64_t lost = 0;      ///< sent, never here
  std::int64_t copies = 0;    ///< of packets that were here: they were sent over two connections
  std::int64_t replaced = 0;  ///< newer images came before they could be sent
  RefusalCounts refused{};
};

struct LiveStatus {
  std::vector<LiveCameraStatus> cameras;
  std::int64_t sets = 0, complete_sets = 0;
  std::int64_t unseen_sets = 0;                          ///< a newer one came before they were asked for
  std::int64_t socket_restarts = 0;                      ///< of the process that holds the sockets
  std::int64_t refused_keys = 0, refused_strangers = 0;  ///< connections, packets of no camera
  double release_ms_p50 = 0, release_ms_p99 = 0;         ///< from the capture to the release
};
/// JSON, for people and scripts.
std::string live_status_json(const LiveStatus& status);

/// Listens on a thread of its own; a process of its own holds the sockets (SocketProcess). Every byte from
/// outside is checked; refused packets are counted by camera and reason. Holds at most SetAssembler::kSlots
/// images of each camera; the newest released set waits for the next call of `wait`, and replaces one that
/// nobody asked for.
///
/// With keys, all connections are CURVE and each key sends for one camera. Without, only this computer can
/// connect.
class RigServer {
 public:
  struct Keys {
    LiveKey server;
    std::vector<LiveClient> clients;
  };
  /// @param keys none: plain. @throws Error when it can't listen; usage Error for plain on an address that
  /// others reach, or cameras whose names no packet can hold.
  RigServer(const std::vector<LiveCamera>& cameras, const LiveSettings& settings,
            const std::optional<Keys>& keys);
  ~RigServer();
  RigServer(const RigServer&) = delete;
  RigServer& operator=(const RigServer&) = delete;

  /// Where it listens: the port where the settings' is a wildcard (tcp://127.0.0.1:*).
  std::string address() const;
  /// Waits for a set that is newer than the last, until `until_s` of now_s(). `set` keeps its memory.
  /// @returns whether there is one. @throws Error when the thread ended.
  bool wait(LiveSet& set, double until_s);
  LiveStatus status() const;
  /// How often the process that holds the sockets was started again.
  std::int64_t socket_restarts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tactus

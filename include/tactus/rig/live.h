#pragma once
/// Cameras that send their images while they film, and the computer that reconstructs. docs/live.md is for
/// users, docs/wire.md has the format of packets.
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// How images of one tick are known.
enum class LiveSync : std::uint8_t {
  time,     ///< by when they were captured
  trigger,  ///< by the number of the trigger that the cameras count
  software  ///< the server sends the triggers
};

/// `live` of a rig file.
struct LiveSettings {
  std::string address = "tcp://127.0.0.1:7447";  ///< where the server listens and clients connect to
  double fps = 30;
  double deadline_s = 0.033;  ///< a set is released so long after its capture, also incomplete
  LiveSync sync = LiveSync::time;
  double bytes_per_s = 20e6;  ///< most of one camera
  std::string keys_folder;    ///< of `tactus keys`
};

/// A key is a file of its own, for its owner's eyes only. Keys are 40 characters of Z85.
struct LiveKey {
  std::string name;  ///< the camera, "server", or "status": it may ask for the server's status
  std::string public_key, secret_key;
  std::string server_key;  ///< public; of clients only
};

struct LiveClient {
  std::string name, public_key;
};

/// A key of `tactus keys`. @throws Error naming the file: others can read it, it is another user's, or no
/// key.
LiveKey read_live_key(const std::string& path);

/// A rectangle of pixels; without any: 0.
struct PixelBox {
  Index left_px = 0, top_px = 0, width_px = 0, height_px = 0;
  friend bool operator==(const PixelBox&, const PixelBox&) = default;
};

/// One camera's images of one tick. A depth camera has `depth_m` alone.
struct CameraImages {
  BitMask mask;
  AlphaImage alpha;
  DepthImage depth_m;
  PixelBox photo_box;      ///< of the silhouette
  std::string photo_jpeg;  ///< of that box
};

/// Why a packet is refused. `none`: it isn't.
enum class Refusal : std::uint8_t {
  none,
  too_short,       ///< than a head, or than its head says
  too_long,        ///< than its head says, or than images of the camera can be
  not_a_packet,    ///< the first bytes are others
  version,         ///< of another format
  head,            ///< its numbers contradict one another
  no_such_camera,  ///< in this rig
  other_camera,    ///< than the sender's key is for
  calibration,     ///< another one than the rig's
  old_boot,        ///< a number of before the camera's last start
  repeated,        ///< sequence number that was there
  too_many,        ///< packets a second
  too_much,        ///< bytes a second
  late,            ///< its set was released
  ahead,           ///< far beyond the newest set
  payload,         ///< images that can't be unpacked
  clock,           ///< sent more than a second off the estimate of the camera's clock
  other_client,    ///< another client of this camera is heard
  count
};
/// "late", "other camera"
const char* refusal_text(Refusal refusal);
using RefusalCounts = std::array<std::int64_t, static_cast<std::size_t>(Refusal::count)>;

/// Hash of all that decides how images are undistorted: size and camera matrix, here without a lens.
std::uint64_t calibration_hash(const Camera& pinhole);

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

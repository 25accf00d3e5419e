#pragma once
/// How cameras reach the computer that reconstructs: `live` of a rig file.
#include <cstdint>
#include <string>

namespace tactus {

/// How images of one tick are known.
enum class LiveSync : std::uint8_t {
  time,     ///< by when they were captured
  trigger,  ///< by the number of the trigger that the cameras count
  software  ///< the server sends the triggers
};

struct LiveSettings {
  std::string address = "tcp://127.0.0.1:7447";  ///< where the server listens and clients connect to
  double fps = 30;
  double deadline_s = 0.033;  ///< a set is released so long after its capture, also incomplete
  LiveSync sync = LiveSync::time;
  double bytes_per_s = 20e6;  ///< most of one camera
  std::string keys_folder;    ///< of `tactus keys`
};

/// Whether every network of this computer leads there (0.0.0.0, [::], *). Takes the same addresses as
/// is_loopback.
bool is_every_interface(const std::string& address);
/// Whether only this computer can connect there. @throws usage Error for an address that is no
/// tcp://HOST:PORT.
bool is_loopback(const std::string& address);

}  // namespace tactus

#pragma once
/// Keys that admit senders: CURVE (Curve25519), one pair for the server and one for each camera.
#include <string>
#include <vector>

namespace tactus {

/// A file of its own, for its owner's eyes only. Keys are 40 characters of Z85.
struct LiveKey {
  std::string name;  ///< the camera, "server", or "status": it may ask for the server's status
  std::string public_key, secret_key;
  std::string server_key;  ///< public; of clients only
};

struct LiveClient {
  std::string name, public_key;
};

inline constexpr const char* kServerName = "server";
inline constexpr const char* kStatusName = "status";

/// @throws Error where ZeroMQ has no CURVE.
LiveKey make_live_key(const std::string& name, const std::string& server_key);

/// Makes the file, readable by its owner alone. @throws Error when it is there already.
void write_live_key(const std::string& path, const LiveKey& key);
/// @throws Error naming the file: others can read it, it is another user's, or no key.
LiveKey read_live_key(const std::string& path);

/// The list of the clients that may connect: lines "NAME PUBLIC-KEY". Replaces the file.
void write_live_clients(const std::string& path, const std::vector<LiveClient>& clients);
/// @throws Error naming file and line; also for a file that others can read or change.
std::vector<LiveClient> read_live_clients(const std::string& path);

/// Files of a folder that `tactus keys` made.
std::string live_key_path(const std::string& folder, const std::string& name);
std::string live_clients_path(const std::string& folder);

/// "", or the missing library and its purpose: "ZeroMQ (libzmq3-dev): no live cameras".
std::string live_missing();

}  // namespace tactus

#pragma once
/// Keys that admit senders: CURVE (Curve25519), one pair for the server and one for each camera.
#include <string>
#include <vector>

#include "tactus/rig/live.h"

namespace tactus {

inline constexpr const char* kServerName = "server";
inline constexpr const char* kStatusName = "status";

/// @throws Error where ZeroMQ has no CURVE.
LiveKey make_live_key(const std::string& name, const std::string& server_key);

/// Makes the file, readable by its owner alone. @throws Error when it is there already.
void write_live_key(const std::string& path, const LiveKey& key);
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

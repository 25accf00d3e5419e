#pragma once
/// Addresses of live cameras.
#include <string>

namespace tactus {

/// Whether every network of this computer leads there (0.0.0.0, [::], *). Takes the same addresses as
/// is_loopback.
bool is_every_interface(const std::string& address);
/// Whether only this computer can connect there. @throws usage Error for an address that is no
/// tcp://HOST:PORT.
bool is_loopback(const std::string& address);

}  // namespace tactus

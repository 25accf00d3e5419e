#include "tactus/rig/live_address.h"

#include <charconv>
#include <string_view>

#include "tactus/base/error.h"

namespace tactus {
namespace {

/// 1 to 65535, or * for any free one. (ZeroMQ takes others modulo 65536.)
bool is_port(std::string_view text) {
  if (text == "*") return true;
  int port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size() && port >= 1 && port <= 65535;
}

/// Host of tcp://HOST:PORT, without brackets.
std::string host_of(const std::string& address) {
  constexpr std::string_view kTcp = "tcp://";
  const std::size_t port = address.rfind(':');
  if (!address.starts_with(kTcp) || port < kTcp.size() + 1 || port + 1 >= address.size())
    throw usage_error("address '" + address + "', expected tcp://HOST:PORT");
  if (!is_port(std::string_view(address).substr(port + 1)))
    throw usage_error("address '" + address + "', expected a port of 1 to 65535, or *");
  std::string host = address.substr(kTcp.size(), port - kTcp.size());
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  return host;
}

}  // namespace

bool is_every_interface(const std::string& address) {
  const std::string host = host_of(address);
  return host == "*" || host == "0.0.0.0" || host == "::";
}

bool is_loopback(const std::string& address) {
  const std::string host = host_of(address);
  // A name may lead anywhere; 127.0.0.0/8 is this computer.
  const bool is_v4 = host.starts_with("127.") && host.find_first_not_of("0123456789.") == host.npos;
  return is_v4 || host == "::1";
}

}  // namespace tactus

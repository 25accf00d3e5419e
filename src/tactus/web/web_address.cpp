#include <sys/random.h>

#include <array>
#include <charconv>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"
#include "tactus/web/web_server.h"

namespace tactus {
namespace {

Error refuse(const std::string& text, const std::string& why) {
  return usage_error(
      "--web '" + text + "': " + why +
      "; expected ADDR:PORT, as 127.0.0.1:8090, after the scene: 'tactus run SCENE --web 8090'");
}

bool is_ipv4(std::string_view text) {
  int parts = 0;
  while (true) {
    const std::size_t dot = text.find('.');
    const std::string_view part = text.substr(0, dot);
    int value = -1;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    if (error != std::errc() || end != part.data() + part.size() || part.size() > 3 || value < 0 ||
        value > 255)
      return false;
    ++parts;
    if (dot == text.npos) return parts == 4;
    text.remove_prefix(dot + 1);
  }
}

}  // namespace

WebSettings parse_web_address(const std::string& text) {
  WebSettings settings;
  if (text.empty()) return settings;
  const std::size_t colon = text.rfind(':');
  const bool only_port = colon == text.npos && text.find_first_not_of("0123456789") == text.npos;
  std::string address = only_port ? "" : text.substr(0, colon);
  const std::string port = only_port ? text : colon == text.npos ? "" : text.substr(colon + 1);
  if (address == "localhost") address = "127.0.0.1";
  if (!address.empty()) {
    if (!is_ipv4(address)) throw refuse(text, "'" + address + "' is no IPv4 address");
    settings.address = address;
  }
  if (!port.empty() || colon != text.npos) {
    const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), settings.port);
    if (error != std::errc() || end != port.data() + port.size() || settings.port < 0 ||
        settings.port > 65535)
      throw refuse(text, "'" + port + "' is no port from 0 to 65535");
  }
  return settings;
}

std::string parse_web_name(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::string name = text.substr(0, colon), port = colon == text.npos ? "443" : text.substr(colon + 1);
  constexpr const char* kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789.-";
  const bool is_name = !name.empty() && name.size() <= 253 && name.find_first_not_of(kLetters) == name.npos;
  const bool is_port = !port.empty() && port.size() <= 5 &&
                       port.find_first_not_of("0123456789") == port.npos && std::stoi(port) > 0 &&
                       std::stoi(port) <= 65535;
  if (is_name && is_port) return port == "443" ? name : text;
  throw usage_error("--web-name '" + printable(text) +
                    "': expected the name of a computer and a port, as browsers open it: lab.example:8443");
}

std::string make_web_token() {
  std::array<unsigned char, 16> random{};
  if (::getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size()))
    throw Error("the system gives no random numbers for the token of --web");
  std::string token;
  for (const unsigned char byte : random) {
    constexpr char kDigits[] = "0123456789abcdef";
    token += kDigits[byte >> 4];
    token += kDigits[byte & 15];
  }
  return token;
}

}  // namespace tactus

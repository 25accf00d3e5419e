#include "tactus/web/viewer_checks.h"

namespace tactus {

std::string host_refusal(bool is_loopback, std::string_view host) {
  if (!is_loopback) return "";  // the token is asked for there
  const std::string_view name = host.substr(0, host.rfind(':'));
  if (name == "localhost" || name == "127.0.0.1") return "";
  return "this server is for its own computer: open it as http://127.0.0.1 or http://localhost";
}

bool is_same_origin(std::string_view origin, std::string_view host) {
  for (const std::string_view scheme : {"http://", "https://"})
    if (origin.starts_with(scheme)) return !host.empty() && origin.substr(scheme.size()) == host;
  return false;
}

bool is_same_token(std::string_view given, std::string_view token) {
  unsigned difference = given.size() == token.size() ? 0 : 1;
  for (std::size_t i = 0; i < token.size(); ++i)
    difference |=
        static_cast<unsigned char>(token[i]) ^ static_cast<unsigned char>(i < given.size() ? given[i] : '\0');
  return difference == 0;
}

}  // namespace tactus

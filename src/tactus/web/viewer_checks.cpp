#include "tactus/web/viewer_checks.h"

#include <algorithm>

namespace tactus {
namespace {

/// Names of computers have no case.
bool is_same_name(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [&](char x, char y) { return lower(x) == lower(y); });
}

}  // namespace

std::string host_refusal(bool is_loopback, std::string_view host, std::string_view name) {
  if (!is_loopback) return "";  // the token is asked for there
  if (!name.empty() && is_same_name(host, name)) return "";
  const std::string_view here = host.substr(0, host.rfind(':'));
  if (here == "localhost" || here == "127.0.0.1") return "";
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

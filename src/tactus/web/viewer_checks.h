#pragma once
/// Who may look: checks of a request's headers, without sockets.
#include <string>
#include <string_view>

namespace tactus {

/// On loopback, a page of another site may reach the port under its own name (DNS rebinding), so Host names
/// loopback, or @param name of a server in front; "": there is none. @returns "", or the reason for refusing.
std::string host_refusal(bool is_loopback, std::string_view host, std::string_view name = "");
/// Whether a page's Origin is the server that Host names: "http://HOST" or "https://HOST".
bool is_same_origin(std::string_view origin, std::string_view host);
/// Compares in a time that says nothing about the place of a difference.
bool is_same_token(std::string_view given, std::string_view token);

}  // namespace tactus

#pragma once
/// Text of files in messages.
#include <string>
#include <string_view>

namespace tactus {

/// Control characters as \x1b: text of a file must not steer a terminal, nor a zero byte end a message. Line
/// ends and tabs stay.
std::string printable(std::string_view text);

}  // namespace tactus

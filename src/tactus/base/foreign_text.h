#pragma once
/// Text that a parser of others will read: bounded before they see it. Such parsers recurse with every
/// bracket and trust every count.
#include <cstdint>
#include <string>
#include <string_view>

namespace tactus {

enum class TextSyntax : std::uint8_t {
  json,  ///< brackets outside of "strings"
  yaml,  ///< brackets wherever they stand (quotes are no syntax in plain YAML), indentation, "- - -"
  xml,   ///< elements
};

/// How deep lists and mappings of people's files are nested; ours need 6.
constexpr int kMaxTextDepth = 64;

/// @param what name of the file in the error: "FILE:LINE: nested more than 64 deep"
/// @throws Error when the text is nested deeper than `max_depth` or holds a zero byte.
void check_foreign_text(std::string_view text, TextSyntax syntax, const std::string& what,
                        int max_depth = kMaxTextDepth);

}  // namespace tactus

#include "tactus/base/foreign_text.h"

#include <algorithm>

#include "tactus/base/error.h"

namespace tactus {
namespace {

/// Counts depth and lines of one text.
class DepthCheck {
 public:
  DepthCheck(std::string_view text, const std::string& what, int max_depth)
      : text_(text), what_(what), max_depth_(max_depth) {}

  void json() {
    bool in_string = false;
    for (std::size_t i = 0; i < text_.size(); ++i) {
      const char c = text_[i];
      line_ += c == '\n' ? 1 : 0;
      if (in_string) {
        if (c == '\\') ++i;
        in_string = c != '"';
        continue;
      }
      in_string = c == '"';
      bracket(c);
    }
  }

  void yaml() {
    int indent = 0;
    bool at_start = true;  // of a line: only spaces, "- " and "? " so far
    for (const char c : text_) {
      if (c == '\n') {
        ++line_;
        indent = 0;
        at_start = true;
        continue;
      }
      // A block begins at least one column right of the block that holds it, so that columns bound the depth;
      // people's indents are wide, so four times as many are allowed.
      if (at_start && (c == ' ' || c == '\t' || c == '-' || c == '?' || c == ':')) {
        if (++indent > 4 * max_depth_) fail();
      } else {
        at_start = false;
      }
      bracket(c);
    }
  }

  void xml() {
    for (std::size_t i = 0; i < text_.size(); ++i) {
      line_ += text_[i] == '\n' ? 1 : 0;
      if (text_[i] != '<') continue;
      const char next = i + 1 < text_.size() ? text_[i + 1] : '\0';
      if (next == '/')
        depth_ = std::max(0, depth_ - 1);
      else if (next != '?' && next != '!')
        enter();
    }
  }

 private:
  void bracket(char c) {
    if (c == '[' || c == '{') enter();
    if (c == ']' || c == '}') depth_ = std::max(0, depth_ - 1);
  }
  void enter() {
    if (++depth_ > max_depth_) fail();
  }
  [[noreturn]] void fail() const {
    throw Error(what_ + ":" + std::to_string(line_) + ": nested more than " + std::to_string(max_depth_) +
                " deep");
  }

  std::string_view text_;
  const std::string& what_;
  int max_depth_, depth_ = 0, line_ = 1;
};

}  // namespace

void check_foreign_text(std::string_view text, TextSyntax syntax, const std::string& what, int max_depth) {
  if (const std::size_t zero = text.find('\0'); zero != std::string_view::npos) {
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(zero), '\n');
    throw Error(what + ":" + std::to_string(line) + ": a zero byte, expected text");
  }
  DepthCheck check(text, what, max_depth);
  switch (syntax) {
    case TextSyntax::json:
      return check.json();
    case TextSyntax::yaml:
      return check.yaml();
    case TextSyntax::xml:
      return check.xml();
  }
}

}  // namespace tactus
